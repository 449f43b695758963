"""The shell of the supervisor: messages in, rulings, faults and answers out."""

import json
import math

import pytest

from groundstation.control.keep_in import rectangle
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.declarations.request import Ack, Request
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.parts.operation.messages import Diagnostics, RecorderStatus
from groundstation.parts.supervision.memory import text_of
from groundstation.parts.supervision.messages import (
    Faults,
    Findings,
    Recalled,
    StopPress,
    Supervision,
    ValveShares,
)
from groundstation.parts.supervision.supervisor_node import PERIOD_NS, SupervisorNode
from groundstation.parts.valves.messages import OutsideControl, ValveStatus
from groundstation.supervision.seen_faults import faults_seen
from groundstation.supervision.sightings import Sightings
from groundstation.supervision.supervisor import Supervisor

MS = 1_000_000
MODEL = VehicleModel(11.0, 0.25, square_of_eight())
KNOWN = frozenset({"fly", "land", "stop", "go_to", "push", "dance"})


class Driven:
    """A node and what it publishes."""

    def __init__(self, *, starts_by_itself=True):
        self.known = Sightings(rectangle((4.0, 3.0), margin_m=0.2), 0.05, 0.15, began_ns=0)
        supervisor = Supervisor(
            self.known, rest_s=8.0, period_ns=PERIOD_NS, starts_by_itself=starts_by_itself
        )
        self.node = SupervisorNode(
            "alpha", MODEL, supervisor, ("beta", "gamma"), KNOWN, {"push": "this vehicle has no command mux"}
        )
        self.now_ns = 0
        self.number = 0

    def receive(self, message):
        return list(self.node.receive(message, self.now_ns))

    def start(self):
        return list(self.node.start(self.now_ns))

    def tick(self, *messages):
        self.now_ns += PERIOD_NS
        for message in messages:
            assert self.receive(message) == []
        return list(self.node.tick(self.now_ns))

    def ask(self, action, author="anna", **arguments):
        self.number += 1
        outputs = self.receive(Request(0, "alpha", self.number, author, action, json.dumps(arguments)))
        acks = [message for message in outputs if isinstance(message, Ack)]
        return acks[0] if acks else None, [message for message in outputs if message not in acks]

    def well(self, *, floating=False, armed=False):
        """One of each message: all is well."""
        return (
            state("alpha"), status_of_fusion(), Findings(0, "alpha", (), ()),
            ValveStatus(self.now_ns, "alpha", 0, 0, armed, False, floating, math.nan, 0, 60.0),
            Wrench(0, "alpha", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        )  # fmt: skip

    def fly(self):
        ruling = None
        for _ in range(30):
            for message in self.tick(
                *self.well(floating=bool(ruling and ruling.air_on), armed=bool(ruling and ruling.may_open))
            ):
                ruling = message if isinstance(message, Supervision) else ruling
        assert ruling.mode == "flying"
        return self


def state(vehicle, position=(0.0, 0.0), velocity=(0.0, 0.0), status="flying", sigma=(1e-3, 1e-3, 1e-3)):
    return VehicleState(0, vehicle, position, 0.5, velocity, 0.25, sigma, status, 1)


def status_of_fusion(rest_s=9.0, fix_age_s=0.5, used=5, refused=0):
    counts = (used, refused, fix_age_s)
    return FusionStatus(0, "alpha", "flying", "m", 0.0, (0.0, 0.0), rest_s, *counts, (0.0, 0.0))


@pytest.fixture
def node():
    driven = Driven()
    driven.start()
    return driven


@pytest.fixture
def landed():
    driven = Driven(starts_by_itself=False)
    driven.start()
    driven.tick()
    return driven


def test_it_rules_nothing_before_it_may_have_remembered_and_then_states_all():
    driven = Driven()
    driven.now_ns = 7
    assert driven.start() == []
    ruling, faults = driven.tick()
    assert (ruling.stamp_ns - PERIOD_NS, ruling.vehicle, ruling.mode, ruling.law) == (
        7,
        "alpha",
        "resting",
        "closed",
    )
    assert (ruling.may_open, ruling.air_on, ruling.stop_latched, ruling.flight_wanted) == (
        False, False, False, True,
    )  # fmt: skip
    assert (ruling.grace_s, ruling.then, ruling.cause, ruling.author) == (
        math.inf, 0, "it has just begun", "",
    )  # fmt: skip
    assert isinstance(faults, Faults)
    assert (faults.ids, faults.gone_ns) == ((), ())
    assert driven.known.began_ns == 7


def test_it_listens_to_every_vehicle_but_to_presses_for_all_too(node):
    assert node.node.sources(VehicleState) == ("alpha", "beta", "gamma")
    assert node.node.sources(StopPress) == ("alpha", "")
    assert node.node.sources(Request) == ("alpha",)


def test_a_ruling_is_repeated_ten_times_a_second_and_published_at_once_when_it_changes(landed):
    stamps = [message.stamp_ns // MS for _ in range(20) for message in landed.tick(*landed.well())]
    assert stamps == [120, 220, 320, 420]
    (ruling,) = landed.receive(StopPress(0, "alpha", 1, "anna"))
    assert (ruling.mode, ruling.stop_latched, ruling.grace_s, ruling.author) == ("stopped", True, 0.0, "anna")
    assert ruling.since_ns == landed.now_ns


def test_what_it_waits_for_is_published(node):
    ruling, _ = node.tick(*node.well()[:1], status_of_fusion(rest_s=2.0), *node.well()[2:])
    assert ruling.waits_for == ("rest: unbroken rest of 2.0 s, 8 s are asked for",)


def test_it_takes_off_and_brakes_for_a_press(node):
    node.fly()
    (ruling,) = node.receive(StopPress(0, "", 1, "anna"))
    assert (ruling.mode, ruling.law, ruling.may_open, ruling.air_on, ruling.then) == (
        "braking", "brake", True, True, 2,
    )  # fmt: skip
    assert node.receive(StopPress(0, "alpha", 1, "anna")) == []  # the same press, repeated


class TestWhatItSees:
    def test_its_own_state_and_those_of_others(self, node):
        node.now_ns = 5
        node.receive(state("beta", (1.0, 0.5), (0.1, 0.2)))
        assert node.known.own is None
        node.receive(state("alpha", (0.5, 0.25), (0.3, 0.4), "lost", (1.0, 2.0, 3.0)))
        seen = node.known.own
        assert (seen.arrival_ns, seen.status, seen.sigma) == (5, "lost", (1.0, 2.0, 3.0))
        assert (seen.state.position_table_m, seen.state.velocity_table_m_s) == ((0.5, 0.25), (0.3, 0.4))
        assert (seen.state.heading_rad, seen.state.rate_rad_s) == (0.5, 0.25)
        assert list(node.known.others) == ["beta"]
        assert node.known.others["beta"].state.position_table_m == (1.0, 0.5)

    def test_fusion_and_recorder(self, node):
        node.now_ns = 5
        node.receive(status_of_fusion(3.0, 0.7))
        node.receive(RecorderStatus(0, "", "x.mcap", 1, 2, 77.0))
        assert (node.known.rest_s, node.known.fix_age_s) == (3.0, 0.7)
        assert (node.known.recorder_ns, node.known.recorder_room_s) == (5, 77.0)

    def test_what_the_recorder_says_of_itself_and_nobody_else(self, node):
        def hears_of(name, level, summary):
            node.receive(Diagnostics(0, "", name, level, summary, (), ()))
            return node.known.recorder_trouble

        assert hears_of("outside", 1, "nobody is there") == ""
        assert hears_of("recorder", 2, "x.mcap.part was deleted") == "x.mcap.part was deleted"
        assert hears_of("recorder", 0, "") == ""

    def test_diagnostics_of_the_rig_concern_every_vehicle(self, node):
        assert node.node.sources(Diagnostics) == ("alpha", "")

    def test_fixes_agree_since_the_last_one_that_was_refused(self, node):
        agreeing = []
        for used, refused in ((1, 0), (3, 0), (3, 0), (4, 1), (5, 1), (6, 1), (2, 1), (4, 1)):
            node.receive(status_of_fusion(used=used, refused=refused))
            agreeing.append(node.known.agreeing)
        assert agreeing == [1, 3, 3, 0, 1, 2, 0, 2]  # the last zero: fusion was started again

    def test_the_valve_node(self, node):
        node.now_ns = 5
        node.receive(ValveStatus(5, "alpha", 1, 2, True, False, False, 30e5, 8, 61.0))
        seen = node.known.node
        assert (seen.arrival_ns, seen.armed, seen.floating, seen.dead_man) == (5, True, False, False)
        assert (seen.pressure_pa, seen.faults) == (30e5, 8)
        node.receive(ValveStatus(2, "alpha", 1, 2, True, False, False, 30e5, 8, 61.0))
        assert node.known.node.arrival_ns == 2, "it waited somewhere: it is as old as its arrival"

    @pytest.mark.parametrize(
        ("open_ratio", "shut_ratio", "braking_m_s2", "is_missing"),
        [
            ([1.0] * 8, [0.0] * 8, 0.9 * 0.44 / 11.0 - 0.005, False),
            ([0.0] + [1.0] * 7, [0.0] * 8, 0.9 * 0.22 / 11.0 - 0.005, False),
            ([0.0, 0.0] + [1.0] * 6, [0.0] * 8, 0.0, True),  # nothing pushes forward
        ],
    )
    def test_valves_that_failed_leave_less_to_brake_with(
        self, node, open_ratio, shut_ratio, braking_m_s2, is_missing
    ):
        node.receive(ValveShares(0, "alpha", tuple(open_ratio), tuple(shut_ratio)))
        assert node.known.braking_m_s2 == pytest.approx(braking_m_s2)
        assert bool(node.known.missing_thrust) is is_missing
        found = faults_seen(node.known, node.now_ns, is_grounded=True, is_aloft=True, may_open=False)
        assert ("thrust_missing" in found) is is_missing

    def test_demands_and_findings(self, node):
        node.now_ns = 5
        node.receive(Wrench(0, "alpha", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        node.receive(Findings(0, "alpha", ("imu_stuck", "pushed"), ("a", "b")))
        assert node.known.demand_ns == 5
        with pytest.raises(ValueError, match="zip"):
            node.receive(Findings(0, "alpha", ("imu_stuck", "pushed"), ("a",)))
        assert (node.known.findings, node.known.findings_ns) == ({"imu_stuck": "a", "pushed": "b"}, 5)


class TestRequests:
    def test_what_counts_is_accepted_and_ruled_at_once(self, landed):
        ack, rulings = landed.ask("fly")
        assert (ack.accepted, ack.reason, ack.author, ack.request_id) == (True, "", "anna", 1)
        assert [ruling.mode for ruling in rulings] == ["resting"]
        assert rulings[0].flight_wanted

    def test_what_does_not_count_is_refused_with_its_reason(self, landed):
        ack, rulings = landed.ask("brake")
        assert not ack.accepted
        assert ack.reason == "brake does not count while it is landed: only a flying vehicle can brake"
        assert rulings == []

    def test_a_stop_is_a_press(self, node):
        node.fly()
        ack, (ruling,) = node.ask("stop")
        assert ack.accepted
        assert (ruling.mode, ruling.stop_latched, ruling.author) == ("braking", True, "anna")
        node.now_ns += 500 * MS
        ack, (ruling,) = node.ask("stop")
        assert ack.accepted
        assert ruling.mode == "landing"

    def test_a_stop_that_is_repeated_is_accepted_and_changes_nothing(self, node):
        node.fly()
        node.ask("stop")
        node.number -= 1
        ack, rulings = node.ask("stop")
        assert ack.accepted
        assert rulings == []

    def test_an_override_reaches_the_gate(self, landed):
        landed.tick(*landed.well()[:1], status_of_fusion(rest_s=2.0), *landed.well()[2:])
        assert "rest" in landed.ask("arm")[0].reason
        ack, (ruling,) = landed.ask("arm", override="on foam")
        assert ack.accepted
        assert ruling.cause == "armed by request: override: on foam"

    def test_arguments_that_are_none_of_the_action_are_refused(self, landed):
        ack, rulings = landed.ask("release", now=True)
        assert not ack.accepted
        assert ack.reason == "release has no argument 'now': it takes no arguments"
        assert rulings == []

    @pytest.mark.parametrize("arguments", ["{", '{"now": 1}', "[]", "9" * 5000])
    @pytest.mark.parametrize("author", ["", "a\nb", "x" * 10_000])
    @pytest.mark.parametrize("action", ["stop", "land", "disarm", "float_off", "brake"])
    def test_what_takes_motion_away_is_not_refused_for_how_it_is_asked(self, node, action, author, arguments):
        node.fly()
        outputs = node.receive(Request(0, "alpha", 9, author, action, arguments))
        (ack,) = (message for message in outputs if isinstance(message, Ack))
        (ruling,) = (message for message in outputs if isinstance(message, Supervision))
        assert (ack.accepted, ack.reason, ack.author) == (True, "", author)
        assert ruling.mode in ("braking", "landing")
        assert ruling.author in ("somebody", "a b", "x" * 64)

    def test_an_action_that_nobody_knows_is_refused_with_those_that_are_known(self, landed):
        ack, _ = landed.ask("jump")
        assert ack.reason == ("unknown action 'jump' (known: dance, fly, go_to, land, push, stop)")

    def test_an_action_that_no_node_answers_here_is_refused(self, landed):
        assert landed.ask("push")[0].reason == "this vehicle has no command mux"

    def test_an_action_of_another_node_is_left_to_it(self, landed):
        assert landed.ask("go_to") == (None, [])


class TestMemory:
    def kept(self, mode, **changes):
        usual = {
            "law": "closed", "may_open": False, "air_on": False, "stop_latched": False, "grace_s": 0.0,
            "flight_wanted": False, "then": 0, "cause": "why", "author": "anna", "since_ns": 0,
            "waits_for": (), "latched": (),
        }  # fmt: skip
        return text_of(Supervision(0, "alpha", mode, **(usual | changes)))

    def test_what_was_kept_is_taken_up_and_ruled(self, node):
        (ruling,) = node.receive(Recalled(0, "alpha", self.kept("stopped", stop_latched=True), ""))
        assert (ruling.mode, ruling.stop_latched, ruling.author) == ("stopped", True, "anna")

    def test_where_nothing_was_kept_it_begins_as_the_rig_says(self, node):
        assert node.receive(Recalled(0, "alpha", "", "")) == []

    def test_what_cannot_be_read_is_a_stop(self, node):
        (ruling,) = node.receive(Recalled(0, "alpha", "", "no permission"))
        assert (ruling.mode, ruling.stop_latched, ruling.cause) == ("landing", True, "no permission")


class TestFaults:
    def test_faults_are_published_when_one_begins_or_ends(self, node):
        node.fly()
        found = Findings(0, "alpha", ("valve_stuck_open",), ("valve 3",))
        begun = node.tick(*node.well(floating=True, armed=True), found)
        (faults,) = [message for message in begun if isinstance(message, Faults)]
        assert (faults.stamp_ns, faults.vehicle) == (node.now_ns, "alpha")
        assert faults.ids == ("valve_stuck_open",)
        assert faults.whats == ("A valve pushes that nobody opened.",)
        assert faults.details == ("valve 3",)
        assert faults.since_ns == (float(node.now_ns),)
        assert faults.responses == ("brakes, then lands",)
        assert faults.advices == ("Clean or replace the valve.",)
        assert faults.gone_ns == (0.0,)
        again = node.tick(*node.well(floating=True, armed=True), found)
        assert not any(isinstance(message, Faults) for message in again)
        later = [
            message
            for _ in range(60)
            for message in node.tick(*node.well(floating=True, armed=True))
            if isinstance(message, Faults)
        ]
        assert [faults.gone_ns for faults in later] == [(faults.since_ns[0] + PERIOD_NS,)]
        assert later[0].responses == ("flies on",)

    def test_the_ruling_goes_before_the_faults(self, node):
        node.fly()
        found = Findings(0, "alpha", ("camera_frozen",), ("",))
        kinds = [type(message) for message in node.tick(*node.well(floating=True, armed=True), found)]
        assert kinds == [Supervision, Faults]


def test_its_period(node):
    assert node.node.tick_period_ns == 20 * MS


def test_it_follows_who_flies_it_from_outside_and_whether_he_is_silent():
    driven = Driven()
    for is_silent, trouble in ((False, ""), (True, "anna: no wrench for 250 ms"), (False, "")):
        assert driven.receive(OutsideControl(0, "alpha", "anna", is_silent, "no wrench for 250 ms")) == []
        assert driven.known.outside_trouble == trouble
