"""One call makes a run in virtual time: with nodes of one's own, and requests at their moments."""

import json
from pathlib import Path

import pytest

from groundstation.bus.journal import Journal, Kind, read_entries
from groundstation.declarations.errors import RigError
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Request
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.imu.messages import ImuOrder
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.valves.messages import CanOut
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"
S = 1_000_000_000


def rig(text=None):
    return parse_rig(text or RIG.read_text(), RIG)


class Kept:
    """Everything that was published, in order."""

    def __init__(self):
        self.all = []

    def __call__(self, delivered, now_ns):
        self.all.append((now_ns, delivered))

    def of(self, kind):
        return [(now_ns, d) for now_ns, d in self.all if isinstance(d.payload, kind)]


class Watcher(Node):
    """Counts states, reports at the end."""

    inputs = (VehicleState,)
    outputs = (Diagnostics,)

    def __init__(self, vehicle="alpha"):
        super().__init__(vehicle, tick_period_ns=100_000_000)
        self.states = self.ticks = self.stops = 0

    def start(self, now_ns):
        yield Diagnostics(now_ns, "", "watcher", 0, "starting", (), ())

    def receive(self, message, now_ns):
        self.states += 1
        return ()

    def tick(self, now_ns):
        self.ticks += 1
        return ()

    def stop(self, now_ns):
        self.stops += 1
        yield Diagnostics(now_ns, "", "watcher", 0, f"{self.states} states", (), ())


def go_to(t_s, **arguments):
    given = {"x_m": 0.2, "y_m": 0.1, "heading_rad": 0.0} | arguments
    return Request(round(t_s * S), "alpha", round(10 * t_s), "test", "go_to", json.dumps(given))


def test_extra_nodes_receive_tick_and_stop_like_those_of_the_rig():
    kept, watcher = Kept(), Watcher()
    runner = make_runner(rig(), 1, [kept], extra_nodes=[watcher])
    runner.run(12 * S)
    assert watcher.states == len(kept.of(VehicleState)) > 100
    assert (watcher.ticks, watcher.stops) == (120, 0)
    runner.close()
    assert watcher.stops == 1
    reported = [d.payload.summary for _, d in kept.of(Diagnostics) if d.payload.node == "watcher"]
    assert reported == ["starting", f"{watcher.states} states"]


def test_what_nodes_publish_when_they_stop_is_seen_and_journaled_before_the_laboratory_goes():
    kept = Kept()
    runner = make_runner(rig(), 1, [kept])
    runner.run(1 * S)
    before = len(kept.all)
    runner.close()
    entries = [e for _, d in kept.of(Journal) for e in read_entries(d.payload)]
    stopped = {e.node for e in entries if e.kind == Kind.STOP}
    started = {e.node for e in entries if e.kind == Kind.START}
    assert stopped == started
    assert isinstance(kept.all[-1][1].payload, Journal)
    last = [d.payload for _, d in kept.all[before:]]
    assert any(isinstance(payload, CanOut) for payload in last)  # the valve writer's last word: closed
    assert {e.now_ns for e in entries if e.kind == Kind.STOP} == {1 * S}


def test_closing_twice_stops_once_and_a_runner_that_never_ran_stops_nothing():
    watcher = Watcher()
    runner = make_runner(rig(), 1, extra_nodes=[watcher])
    runner.close()
    assert watcher.stops == 0
    runner = make_runner(rig(), 1, extra_nodes=[watcher])
    runner.run(S // 10)
    runner.close()
    runner.close()
    assert watcher.stops == 1


def test_requests_are_made_at_their_stamps_and_answered():
    kept = Kept()
    asked = [go_to(0.30), go_to(0.20, x_m=9.0), go_to(0.25, speeed=1.0)]  # in whatever order they are given
    runner = make_runner(rig(), 1, [kept], requests=asked)
    runner.run(1 * S)
    runner.close()
    made = [(now_ns, d.payload.request_id) for now_ns, d in kept.of(Request)]
    assert made == [(round(0.2 * S), 2), (round(0.25 * S), 2), (round(0.3 * S), 3)]
    answers = [d.payload for _, d in kept.of(Ack) if d.payload.author == "test"]
    assert [ack.accepted for ack in answers] == [False, False, True]
    assert "outside" in answers[0].reason
    assert "no argument 'speeed'" in answers[1].reason


def test_a_run_with_nodes_and_requests_of_ones_own_is_the_same_twice():
    def fly():
        kept = Kept()
        runner = make_runner(rig(), 4, [kept], extra_nodes=[Watcher()], requests=[go_to(0.5)])
        runner.run(2 * S)
        runner.close()
        return [(now_ns, d.envelope) for now_ns, d in kept.all]

    assert fly() == fly()


def test_nodes_that_only_watch_change_nothing_of_the_flight():
    def wrenches(*extra):
        kept = Kept()
        runner = make_runner(rig(), 4, [kept], extra_nodes=extra)
        runner.run(12 * S)
        runner.close()
        return [(now_ns, d.envelope.sequence, d.payload.torque_z_nm) for now_ns, d in kept.of(Wrench)]

    assert wrenches() == wrenches(Watcher())


def test_an_extra_node_may_send_orders_through_a_port():
    class Ordering(Node):
        inputs = (VehicleState,)
        outputs = (ImuOrder,)

        def receive(self, message, now_ns):
            return ()

        def start(self, now_ns):
            yield ImuOrder(now_ns, "alpha", b"?")

    kept = Kept()
    runner = make_runner(rig(), 1, [kept], extra_nodes=[Ordering("alpha")])
    runner.run(S // 10)
    runner.close()
    assert b"?" in [d.payload.data for _, d in kept.of(ImuOrder)]


def test_a_run_without_a_journal_publishes_none():
    kept = Kept()
    runner = make_runner(rig(), 1, [kept], journaled=False)
    runner.run(S // 2)
    runner.close()
    assert kept.of(Journal) == []
    assert kept.all


def test_real_hardware_is_refused_in_one_sentence():
    text = RIG.read_text()
    with pytest.raises(RigError, match="alpha/imu: '/dev/ttyUSB0' is real hardware, which runs in real time"):
        make_runner(rig(text.replace("laboratory:alpha/imu", "/dev/ttyUSB0")), 1)


def test_a_laboratory_that_refuses_its_table_is_named_by_key():
    with pytest.raises(RigError, match=r"'laboratory\.table\.tild_rad' is no known key"):
        make_runner(rig(RIG.read_text().replace("tilt_rad", "tild_rad")), 1)
