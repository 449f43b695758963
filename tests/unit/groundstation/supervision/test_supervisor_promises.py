"""What a supervisor promises whatever it sees and whoever asks for what, restarts included."""

import math

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from groundstation.control.keep_in import rectangle
from groundstation.control.state import ControlState
from groundstation.supervision.faults import FAULTS
from groundstation.supervision.mode_machine import GRACE_S, NEW_PRESS_S
from groundstation.supervision.modes import GROUNDED, GUARANTEES, Air, Event, Law, Mode
from groundstation.supervision.sightings import NodeSeen, Seen, Sightings
from groundstation.supervision.supervisor import Supervisor

PERIOD_NS = 20_000_000
S = 1_000_000_000
ASKED = [
    Event.FLY, Event.ARM, Event.DISARM, Event.FLOAT_ON, Event.FLOAT_OFF, Event.LAND, Event.RELEASE,
    Event.BRAKE, Event.RESUME,
]  # fmt: skip
FOUND = sorted(set(FAULTS) - {"commands_restarted"})
PLACES = st.tuples(st.sampled_from([-1.7, 0.0, 1.0, 1.75]), st.sampled_from([-1.2, 0.0, 1.25]))
SPEEDS = st.sampled_from([(0.0, 0.0), (0.005, 0.0), (0.1, 0.0), (-0.2, 0.1)])


class SupervisedVehicle(RuleBasedStateMachine):
    """The world is drawn; what must hold is judged after every single look, request and press."""

    @initialize(starts_by_itself=st.booleans())
    def begin(self, starts_by_itself):
        self.now_ns = 0
        self.starts_by_itself = starts_by_itself
        self.floating, self.air_obeys = False, True
        self.silent, self.findings = frozenset(), {}
        self.position, self.velocity, self.status = (0.0, 0.0), (0.0, 0.0), "flying"
        self.press_id = 0
        self.pressed_ns = None  # the first press of a stop that nobody has released
        self.wanted = starts_by_itself  # a person, or the rig, wants flight
        self.asked_for_air = starts_by_itself
        self._supervisor()
        self.look(200)

    def _supervisor(self):
        self.sightings = Sightings(rectangle((4.0, 3.0), margin_m=0.2), 0.05, 0.15, self.now_ns)
        self.supervisor = Supervisor(
            self.sightings, rest_s=8.0, period_ns=PERIOD_NS, starts_by_itself=self.starts_by_itself
        )

    @rule(looks=st.sampled_from([1, 5, 20, 60, 120, 600]))
    def look(self, looks):
        for _ in range(looks):
            self.now_ns += PERIOD_NS
            now_ns, known, ruling = self.now_ns, self.sightings, self.supervisor.ruling()
            if self.air_obeys:
                self.floating = ruling.is_air_on
            if "state" not in self.silent:
                state = ControlState(self.position, self.velocity, 0.0, 0.0)
                known.own = Seen(now_ns, state, self.status, (0.001,) * 3)
            if "node" not in self.silent:
                known.node = NodeSeen(now_ns, ruling.may_open, self.floating, False, math.nan, 0)
            if "detector" not in self.silent:
                known.findings, known.findings_ns = self.findings, now_ns
            if "demand" not in self.silent:
                known.demand_ns = now_ns
            known.rest_s, known.fix_age_s, known.agreeing = 8.0, 0.5, 2
            self.supervisor.look(now_ns)
            self.judge()

    @rule(silent=st.frozensets(st.sampled_from(["state", "node", "detector", "demand"]), max_size=2))
    def somebody_falls_silent(self, silent):
        self.silent = silent
        self.look(20)

    @rule()
    def all_is_well_again(self):
        self.silent, self.findings, self.status, self.air_obeys = frozenset(), {}, "flying", True
        self.position = self.velocity = (0.0, 0.0)
        self.look(100)

    @rule(findings=st.lists(st.sampled_from(FOUND), max_size=2, unique=True))
    def something_is_found(self, findings):
        self.findings = dict.fromkeys(findings, "drawn")
        self.look(5)

    @rule(position=PLACES, velocity=SPEEDS)
    def it_moves(self, position, velocity):
        self.position, self.velocity = position, velocity
        self.look(2)

    @rule(status=st.sampled_from(["flying", "flying", "lost", "resting"]))
    def the_estimator_reports(self, status):
        self.status = status
        self.look(2)

    @rule(floating=st.booleans())
    def the_air_has_a_will_of_its_own(self, floating):
        self.air_obeys, self.floating = False, floating
        self.look(5)

    @rule(event=st.sampled_from(ASKED), override=st.sampled_from(["", "a reason"]))
    def ask(self, event, override):
        before = self.supervisor.ruling()
        refusal = self.supervisor.request(event, "anna", self.now_ns, override)
        if refusal:
            assert self.supervisor.ruling() == before
            assert event not in (Event.LAND, Event.DISARM, Event.FLOAT_OFF), refusal
        elif event is Event.RELEASE:
            self.pressed_ns, self.wanted, self.asked_for_air = None, False, False
        elif event in (Event.LAND, Event.DISARM, Event.FLOAT_OFF):
            self.wanted = self.asked_for_air = False
        else:
            self.wanted = self.wanted or event is Event.FLY
            self.asked_for_air = self.asked_for_air or event in (Event.FLY, Event.ARM, Event.FLOAT_ON)
        self.judge()

    @rule(is_repeated=st.booleans())
    def press(self, is_repeated):
        self.press_id += not is_repeated or self.press_id == 0
        mode = self.supervisor.mode
        counted = self.supervisor.press("anna", self.press_id, self.now_ns)
        if not counted:
            assert self.supervisor.mode is mode
        if counted and self.pressed_ns is None:
            self.pressed_ns = self.now_ns
        elif counted:
            assert self.now_ns - self.pressed_ns >= NEW_PRESS_S * S or mode in (*GROUNDED, Mode.LANDING)
            assert GUARANTEES[self.supervisor.mode].air is Air.OFF
        if counted:
            self.wanted = self.asked_for_air = False
        self.judge()

    @rule()
    def the_process_is_started_again(self):
        memory = self.supervisor.ruling().memory
        self._supervisor()
        self.supervisor.recall(memory, self.now_ns)
        assert self.supervisor.mode is memory.mode or self.supervisor.mode in (Mode.BRAKING, Mode.LANDING)
        self.judge()

    def judge(self):
        ruling = self.supervisor.ruling()
        memory = ruling.memory
        assert memory.is_stop_latched == (self.pressed_ns is not None)
        assert not memory.is_flight_wanted or self.wanted
        assert not ruling.may_open or ruling.law is not Law.CLOSED or memory.mode is Mode.ARMED
        assert not ruling.is_air_on or self.asked_for_air or self.pressed_ns is not None
        if self.pressed_ns is not None:
            assert ruling.law is not Law.CONTROLLER
            if ruling.may_open or ruling.is_air_on:
                assert memory.mode in (Mode.BRAKING, Mode.HOLDING)
                assert ruling.grace_s == GRACE_S
                assert self.now_ns - self.pressed_ns <= GRACE_S * S
            else:
                assert ruling.grace_s == 0.0
        else:
            assert ruling.grace_s == math.inf

    @invariant()
    def causes_are_sentences_for_people(self):
        assert self.supervisor.ruling().memory.cause


SupervisedVehicle.TestCase.settings = settings(
    max_examples=60, stateful_step_count=25, deadline=None, derandomize=True
)
test_the_supervisor_keeps_its_promises_on_a_bad_day = SupervisedVehicle.TestCase
