"""The player: t = 0 when all fly, rows at their moments, answers compared, one reason when it fails."""

import pytest

from groundstation.declarations.lease import Lease
from groundstation.declarations.request import Ack, Request
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.scenario.conditions import Bounds
from groundstation.parts.scenario.messages import Marker, ScenarioStatus
from groundstation.parts.scenario.player import Player
from groundstation.parts.scenario.sections import ScenarioSection, TimelineRow
from groundstation.parts.supervision.messages import Supervision

MS = 1_000_000
STEP_MS = 20


class Run:
    """A player with vehicles that do what the test says."""

    def __init__(self, *rows, **more):
        given = {"name": "t", "ready_s": 5.0, "duration_s": 10.0, "starters": ("alpha", "beta"), **more}
        section = ScenarioSection(**given, timeline=rows)
        self.player = Player(section, ("alpha", "beta"), Bounds((-2.0, 2.0), (-1.5, 1.5)))
        self.now_ms = 0
        self.said = []
        self.modes = {"alpha": "resting", "beta": "resting"}
        self.off_m = {"alpha": 0.0, "beta": 0.0}
        self._take(self.player.start(0))

    def _take(self, made):
        self.said += [(self.now_ms, message) for message in made]

    def until(self, stop_ms):
        while self.now_ms < stop_ms:
            self.now_ms += STEP_MS
            now_ns = self.now_ms * MS
            for name, mode in self.modes.items():
                place = (-1.0 if name == "alpha" else 1.0, 0.0)
                goal = (place[0] + self.off_m[name], 0.0)
                sigma = (1e-3, 1e-3, 1e-3)
                self._take(self.player.receive(_ruling(now_ns, name, mode), now_ns))
                state = VehicleState(now_ns, name, place, 0.0, (0.0, 0.0), 0.0, sigma, "flying", 1)
                self._take(self.player.receive(state, now_ns))
                status = ControlStatus(now_ns, name, "go_to", goal, 0.0, self.off_m[name], 0.0, (), ())
                self._take(self.player.receive(status, now_ns))
            self._take(self.player.tick(now_ns))

    def fly(self):
        self.until(STEP_MS)
        self.modes = dict.fromkeys(self.modes, "flying")

    def of(self, kind):
        return [(at_ms, message) for at_ms, message in self.said if isinstance(message, kind)]

    def answer(self, reason="", request=None):
        _, asked = self.of(Request)[-1] if request is None else (0, request)
        ack = Ack(0, asked.vehicle, asked.request_id, asked.author, asked.action, not reason, reason)
        self._take(self.player.receive(ack, self.now_ms * MS))

    @property
    def status(self):
        return self.of(ScenarioStatus)[-1][1]


def _ruling(now_ns, vehicle, mode):
    return Supervision(
        now_ns, vehicle, mode, "controller", True, True, False, 0.0, True, 0, "", "", now_ns, (), ()
    )


def row(**keys):
    return TimelineRow(where="timeline.0", **keys)


def test_zero_is_when_the_last_one_flies():
    run = Run(row(at_s=1.0, mark="one"))
    run.until(20)
    run.modes["alpha"] = "flying"
    run.until(1000)
    assert run.status.state == "waiting"
    assert run.status.waits_for == "beta does not fly"
    run.fly()
    run.until(1020)
    assert (run.status.state, run.status.zero_ns) == ("running", 1020 * MS)
    run.until(3000)
    assert [(at_ms, marker.text) for at_ms, marker in run.of(Marker)] == [(2020, "one")]


def test_vehicles_that_do_not_get_ready_fail_the_run():
    run = Run(ready_s=2.0)
    run.until(3000)
    assert run.status.state == "failed"
    assert run.status.reason == "ready_s: alpha does not fly after 2 s"


def test_on_hardware_zero_also_waits_until_they_have_settled_at_their_starts():
    run = Run(settle_first=True)
    run.fly()
    run.off_m["beta"] = 0.5
    run.until(4000)
    assert run.status.waits_for == "beta has not settled at its start"
    run.off_m["beta"] = 0.0
    run.until(7500)
    assert run.status.state == "failed"  # ready_s = 5 s was over before three seconds of rest
    run = Run(settle_first=True)
    run.fly()
    run.until(3100)
    assert run.status.state == "running"


def test_programs_are_begun_at_zero():
    run = Run(resumed=("beta",))
    run.fly()
    run.until(40)
    ((at_ms, asked),) = run.of(Request)
    assert (at_ms - 20, asked.vehicle, asked.action, asked.author) == (20, "beta", "resume", "scenario")


def test_each_vehicle_of_a_row_is_asked_with_an_id_of_its_own():
    run = Run(row(at_s=0.5, vehicles=("alpha", "beta"), action="land"))
    run.fly()
    run.until(1000)
    asked = [message for _, message in run.of(Request)]
    assert [each.vehicle for each in asked] == ["alpha", "beta"]
    assert len({each.request_id for each in asked}) == 2


@pytest.mark.parametrize(
    ("expected", "reason", "fails"),
    [
        ("accepted", "", False),
        ("accepted", "too near", True),
        ("refused", "too near", False),
        ("refused", "", True),
        ("any", "", False),
        ("any", "too near", False),
    ],
)
def test_another_answer_than_expected_fails_the_run(expected, reason, fails):
    run = Run(row(at_s=0.0, vehicles=("alpha",), action="land", answer=expected))
    run.fly()
    run.until(100)
    run.answer(reason)
    run.until(200)
    assert (run.status.state == "failed") is fails
    if fails:
        assert run.status.reason.startswith("timeline.0: alpha's land was ")
        assert reason in run.status.reason


def test_what_nobody_answers_fails_the_run():
    run = Run(row(at_s=0.0, vehicles=("alpha",), action="land"))
    run.fly()
    run.until(5100)
    assert run.status.reason == "timeline.0: nobody answered alpha's land"


def test_answers_to_others_are_not_its_own():
    run = Run(row(at_s=0.0, vehicles=("alpha",), action="land"))
    run.fly()
    run.until(100)
    (_, asked) = run.of(Request)[0]
    run.answer("no", Request(0, "alpha", asked.request_id, "anna", "land", "{}"))
    run.until(200)
    assert run.status.state == "running"


def test_a_wait_begins_where_the_row_above_was_carried_out_and_its_delay_where_it_holds():
    first = TimelineRow(where="timeline.0", at_s=1.0, mark="one")
    second = TimelineRow(where="timeline.1", when="alpha.settled", timeout_s=6.0, after_s=0.5, mark="two")
    run = Run(first, second)
    run.fly()
    run.until(10_040)
    # settled since the start, but counted from the row above: 1 s + 3 s + 0.5 s after t = 0 at 40 ms
    assert [(at_ms, marker.text) for at_ms, marker in run.of(Marker)] == [(1040, "one"), (4540, "two")]
    assert run.status.state == "ended"


def test_a_wait_that_takes_too_long_fails_the_run():
    run = Run(row(when="alpha.settled", timeout_s=4.0, mark="never"))
    run.off_m["alpha"] = 0.2
    run.fly()
    run.until(4060)
    assert run.status.reason == "timeline.0: 'alpha.settled' did not come true within 4 s"


def test_it_ends_after_its_duration_and_says_so_once_for_good():
    run = Run(duration_s=1.0)
    run.fly()
    run.until(1000)
    assert run.status.state == "running"
    run.until(1040)
    assert run.status.state == "ended"
    run.until(3000)
    assert {status.state for _, status in run.of(ScenarioStatus)} == {"waiting", "running", "ended"}


def test_a_row_that_had_not_come_when_the_run_ended_fails_it():
    run = Run(row(when="alpha.landed", timeout_s=60.0, mark="down"), duration_s=1.0)
    run.fly()
    run.until(1100)
    assert run.status.state == "failed"
    assert run.status.reason == "timeline.0: had not come when the run ended"


def test_who_is_started_again_while_they_fly_carries_nothing_out_twice():
    run = Run(row(at_s=0.0, vehicles=("alpha",), action="land"))
    run.modes = dict.fromkeys(run.modes, "flying")
    run.until(100)
    assert run.status.state == "failed"
    assert "alpha flew already" in run.status.reason
    assert run.of(Request) == []


def _start(run, author="anna"):
    request = Request(0, "", 7, author, "start_scenario", "{}")
    (ack,) = run.player.receive(request, run.now_ms * MS)
    return ack.reason


def test_started_by_hand_it_waits_for_a_person_however_long():
    run = Run(row(at_s=1.0, mark="one"), by_hand=True, ready_s=2.0)
    assert _start(run) == "alpha does not fly"
    run.fly()
    run.until(9000)
    assert (run.status.state, run.status.waits_for) == ("waiting", "a person's start_scenario")
    assert _start(run) == ""
    run.until(10_100)
    assert (run.status.state, run.status.zero_ns) == ("running", 9020 * MS)
    assert [at_ms for at_ms, _ in run.of(Marker)] == [10_020]
    assert "running" in _start(run)


def test_one_that_starts_by_itself_is_started_by_nobody():
    run = Run()
    assert "not started by hand" in _start(run)


def test_who_does_not_hold_control_starts_nothing():
    run = Run(by_hand=True)
    run.fly()
    run.until(100)
    run._take(run.player.receive(Lease(0, "", "bert", 10**12, ""), 1))
    assert "bert" in _start(run)
    assert run.status.state == "waiting"
    assert _start(run, "bert") == ""
