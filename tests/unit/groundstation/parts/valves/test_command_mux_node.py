"""The shell of the multiplexer: who commands by the supervisor's ruling, filtered, as pulses; by messages."""

import itertools
import json
import math
from copy import deepcopy
from functools import cache

import pytest

from groundstation.control.allocation import Allocator
from groundstation.control.brake import BrakeConfig, brake_wrench, dead_reckoned
from groundstation.control.braking import Braking
from groundstation.control.keep_in import rectangle
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.mux import CommandMux, MuxConfig
from groundstation.control.safety_filter import SafetyFilter, SafetyFilterConfig
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState
from groundstation.control.surroundings import Surroundings
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.declarations.lease import Lease
from groundstation.declarations.request import Ack, Request
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.outside.messages import OutsideWrench
from groundstation.parts.supervision.messages import Supervision, ValveShares
from groundstation.parts.valves.command_mux_node import CommandMuxNode
from groundstation.parts.valves.messages import Outlook, OutsideControl, ValveDemand, ValveSelection

MS = 1_000_000
MODEL = VehicleModel(11.0, 0.25, square_of_eight())


def modulator():
    return PulseModulator(Allocator(MODEL), PulseConfig())


@cache
def made():
    pulses = modulator()
    return CommandMuxNode(
        "alpha",
        ("beta",),
        CommandMux(MuxConfig()),
        Braking(BrakeConfig(), MODEL, pulses.envelope, 100 * MS),
        SafetyFilter(SafetyFilterConfig(), rectangle((4.0, 3.0), margin_m=0.2)),
        Surroundings(0.2),
        MODEL,
        pulses,
    )


@pytest.fixture
def mux():
    return deepcopy(made())  # the facets of what its valves can make take a quarter of a second


@pytest.fixture
def flying(mux):
    list(mux.receive(ruling("controller"), 0))
    list(mux.receive(state(-5000 * MS), -5000 * MS))
    return mux


def ruling(law, mode=None, cause="the cause"):
    usual = {"controller": "flying", "brake": "braking", "closed": "landed"}
    opens = law != "closed"
    return Supervision(
        0, "alpha", mode or usual[law], law, opens, opens, False, math.inf, True, 0, cause, "", 0, (), ()
    )


PUSH = BodyWrench((0.1, 0.0), 0.0)


def demand(push=PUSH):
    fx, fy = push.force_body_n
    return Wrench(0, "alpha", fx, fy, 0.0, 0.0, 0.0, push.torque_nm)


def pulses(*pushes):
    """On-times of wrenches that follow each other, from nothing carried over."""
    made = modulator()
    return [bytes(made.update(push).on_time_ms) for push in pushes]


def state(
    now_ns, position=(0.0, 0.0), velocity=(0.0, 0.0), status="flying", rate_rad_s=0.0, heading_rad=0.0,
    vehicle="alpha",
):  # fmt: skip
    return VehicleState(
        now_ns, vehicle, position, heading_rad, velocity, rate_rad_s, (1e-3, 1e-3, 1e-3), status, 1
    )


def request(action, **arguments):
    return Request(0, "alpha", 1, "operator", action, json.dumps(arguments))


def push(**arguments):
    return request(
        "push", **{"force_x_n": 0.2, "force_y_n": 0.0, "torque_nm": 0.0, "span_s": 0.3} | arguments
    )


def tick(mux, now_ms):
    return selected(mux.tick(now_ms * MS))


def selected(messages):
    """The selection among what was published."""
    [selection] = [each for each in messages if isinstance(each, ValveSelection)]
    return selection


def give(mux, now_ms, push=PUSH):
    """A wrench of the controller arrives."""
    return selected(mux.receive(demand(push), now_ms * MS))


def rule(mux, now_ms, law, **words):
    found = mux.receive(ruling(law, **words), now_ms * MS)
    return [each for each in found if isinstance(each, ValveSelection)]


class TestLaws:
    def test_before_the_first_ruling_and_after_the_last_one_all_valves_close(self, mux):
        selection = give(mux, 0)
        assert (selection.source, selection.on_time_ms) == ("closed", bytes(8))
        assert selection.reason == "nothing comes from the supervisor"
        rule(mux, 0, "controller")
        give(mux, 400)
        assert tick(mux, 500).source == "controller"
        silent = tick(mux, 501)
        assert (silent.source, silent.on_time_ms) == ("closed", bytes(8))

    @pytest.mark.parametrize("words", [{}, {"mode": "armed", "cause": "armed by request"}])
    def test_a_closed_vehicle_closes_whoever_demands_what(self, mux, words):
        rule(mux, 0, "closed", **words)
        list(mux.receive(state(0, velocity=(0.1, 0.0)), 0))
        selection = give(mux, 0)
        assert (selection.source, selection.on_time_ms) == ("closed", bytes(8))
        assert selection.reason == (": ".join(words.values()) or "landed: the cause")
        assert tick(mux, 20).source == "closed"

    def test_a_ruling_that_changes_the_law_is_obeyed_at_once_and_a_repeated_one_is_silent(self, flying):
        give(flying, 10)
        (closed,) = rule(flying, 20, "closed")
        assert (closed.source, closed.on_time_ms) == ("closed", bytes(8))
        assert rule(flying, 30, "closed") == []
        (again,) = rule(flying, 40, "controller")
        assert again.source == "closed"  # the old demand does not come back to life

    def test_braking_by_order_says_why(self, flying):
        list(flying.receive(state(0, velocity=(0.05, 0.0)), 0))
        (selection,) = rule(flying, 20, "brake", cause="stopped: brakes")
        assert (selection.source, selection.reason) == ("brake", "braking: stopped: brakes")
        assert selection.on_time_ms[2] > 0
        assert selection.on_time_ms[3] > 0
        assert not any(selection.on_time_ms[:2])

    def test_braking_by_order_beats_operator_and_controller(self, flying):
        list(flying.receive(state(0), 0))
        list(flying.receive(push(), 0))
        give(flying, 0)
        rule(flying, 0, "brake")
        give(flying, 10)
        assert tick(flying, 20).source == "brake"

    def test_without_a_state_braking_closes(self, flying):
        (selection,) = rule(flying, 20, "brake")
        assert (selection.source, selection.on_time_ms) == ("closed", bytes(8))

    @pytest.mark.parametrize("status", ["starting", "resting", "lost"])
    def test_only_a_state_in_flight_is_one_to_brake_on(self, flying, status):
        list(flying.receive(state(0, status=status), 0))
        assert rule(flying, 20, "brake")[0].source == "closed"


class TestController:
    def test_a_new_demand_goes_out_at_once(self, flying):
        selection = give(flying, 5)
        assert (selection.source, selection.on_time_ms) == ("controller", pulses(PUSH)[0])
        assert (selection.stamp_ns, selection.vehicle) == (5 * MS, "alpha")

    def test_an_old_demand_is_refreshed_and_not_started_again(self, flying):
        first = give(flying, 5)
        second = tick(flying, 20)
        assert second.pulse_id == first.pulse_id
        assert second.counter == (first.counter + 1) % 16
        third = give(flying, 25)
        assert third.pulse_id == (first.pulse_id + 1) % 16

    def test_counter_and_pulse_id_go_round_at_sixteen(self, flying):
        seen = [give(flying, 5) for _ in range(32)]
        assert {selection.counter for selection in seen} == set(range(16))
        assert [s.pulse_id for s in seen] == [(seen[0].pulse_id + step) % 16 for step in range(32)]

    def test_silence_brakes_against_the_velocity(self, flying):
        give(flying, 0, NO_WRENCH)
        list(flying.receive(state(400 * MS, velocity=(0.05, 0.0)), 400 * MS))
        selection = tick(flying, 420)
        assert selection.source == "brake"
        assert selection.on_time_ms[2] > 0
        assert selection.on_time_ms[3] > 0
        assert not any(selection.on_time_ms[:2])

    def test_without_a_fresh_state_silence_closes_the_valves_with_one_new_pulse(self, flying):
        before = give(flying, 0)
        closed = tick(flying, 500)
        assert (closed.source, closed.on_time_ms) == ("closed", bytes(8))
        assert closed.pulse_id == (before.pulse_id + 1) % 16
        assert tick(flying, 500).pulse_id == closed.pulse_id

    def test_after_closed_valves_a_demand_that_is_still_fresh_begins_a_new_pulse(self, flying):
        first = give(flying, 400)
        closed = tick(flying, 501)  # the ruling is too old
        rule(flying, 502, "controller")
        again = tick(flying, 520)
        assert (again.source, again.on_time_ms) == ("controller", pulses(PUSH)[0])
        assert [first.pulse_id, closed.pulse_id, again.pulse_id] == [
            first.pulse_id + step for step in (0, 1, 2)
        ]


class TestBraking:
    def brake(self, mux, velocity=(0.05, 0.0), rate_rad_s=0.0):
        list(mux.receive(state(0, velocity=velocity, rate_rad_s=rate_rad_s), 0))
        return rule(mux, 0, "brake")[0]

    def test_a_braking_pulse_lasts_a_period_of_the_modulation(self, mux):
        pulse_ids = [self.brake(mux).pulse_id]
        for now_ms in range(20, 320, 20):
            list(mux.receive(state(now_ms * MS, velocity=(0.05, 0.0)), now_ms * MS))
            rule(mux, now_ms, "brake")
            pulse_ids.append(tick(mux, now_ms).pulse_id)
        first = pulse_ids[0]
        assert pulse_ids == [first + step // 5 for step in range(16)]

    def test_braking_is_what_the_brake_law_asks_for_with_the_newest_state(self, mux):
        list(mux.receive(state(0, (0.3, 0.2), (0.05, -0.02), rate_rad_s=0.4, heading_rad=0.7), 0))
        (selection,) = rule(mux, 0, "brake")
        known = ControlState((0.3, 0.2), (0.05, -0.02), 0.7, 0.4)
        wrench = brake_wrench(known, BrakeConfig(), MODEL, WrenchEnvelope(MODEL))
        assert selection.on_time_ms == bytes(modulator().update(wrench).on_time_ms)

    def expected(self, known_at, now_ms, known):
        """On-times by hand: a pulse each 100 ms, states carried on by what the pulses before gave."""
        envelope, pulses, braked, on_times = WrenchEnvelope(MODEL), modulator(), BodyWrench((0, 0), 0.0), []
        for stamp_ms in range(0, now_ms, 100):
            if stamp_ms - known_at > 100:
                known = dead_reckoned(known, braked, 0.1, MODEL)
            found = pulses.update(brake_wrench(known, BrakeConfig(), MODEL, envelope))
            braked = found.delivered
            on_times.append(bytes(found.on_time_ms))
        return on_times

    def test_without_new_states_braking_goes_on_by_dead_reckoning_until_it_stands(self, mux):
        velocity = (0.03, 0.0)
        on_times = [self.brake(mux, velocity).on_time_ms]
        for now_ms in range(20, 2000, 20):
            rule(mux, now_ms, "brake")
            selection = tick(mux, now_ms)
            assert selection.source == "brake"
            if now_ms % 100 == 0:
                on_times.append(selection.on_time_ms)
        assert on_times == self.expected(0, 2000, ControlState((0.0, 0.0), velocity, 0.0, 0.0))
        assert any(on_times[0])
        assert not any(on_times[-1])  # dead reckoned to rest: it does not push backwards for ever

    def test_a_state_of_one_period_ago_is_used_as_it_is(self, mux):
        self.brake(mux)
        list(mux.receive(state(20 * MS, velocity=(0.0, 0.0)), 20 * MS))
        for now_ms in range(20, 101, 20):
            rule(mux, now_ms, "brake")
            last = tick(mux, now_ms)
        assert not any(last.on_time_ms)

    def test_two_seconds_without_a_state_end_it(self, mux):
        self.brake(mux)
        for now_ms in range(20, 2021, 20):
            rule(mux, now_ms, "brake")
            last = tick(mux, now_ms)
        assert (last.source, last.on_time_ms) == ("closed", bytes(8))

    def test_braking_begins_with_nothing_carried_over(self, mux):
        first = self.brake(mux, (0.004, 0.0))
        for now_ms in range(20, 200, 20):
            list(mux.receive(state(now_ms * MS, velocity=(0.004, 0.0)), now_ms * MS))
            rule(mux, now_ms, "brake")
            tick(mux, now_ms)
        rule(mux, 200, "closed")
        list(mux.receive(state(210 * MS, velocity=(0.004, 0.0)), 210 * MS))
        (again,) = rule(mux, 210, "brake")
        assert again.on_time_ms == first.on_time_ms
        assert again.source == "brake"


class TestPush:
    def sources(self, mux, steps):
        found = []
        for step in range(1, steps):
            now_ns = step * 20 * MS
            list(mux.receive(ruling("controller"), now_ns))
            list(mux.receive(state(now_ns), now_ns))
            give(mux, step * 20, NO_WRENCH)
            found.append(tick(mux, step * 20))
        return found

    def test_it_outranks_the_controller_and_ends_by_itself(self, flying):
        (ack,) = flying.receive(push(), 0)
        assert (ack.accepted, ack.reason, ack.action) == (True, "", "push")
        found = self.sources(flying, 40)
        for number, selection in enumerate(found, 1):
            pushes = number * 20 < 300
            assert any(selection.on_time_ms[:2]) is pushes
            # closed for its last 0.3 s, then the controller's again
            assert selection.source == ("operator" if number * 20 <= 600 else "controller")

    def test_it_is_a_new_pulse_each_period(self, flying):
        list(flying.receive(push(force_x_n=0.0, force_y_n=-0.3, torque_nm=0.0, span_s=1.0), 0))
        found = self.sources(flying, 30)
        changes = [
            number * 20
            for number, (old, new) in enumerate(itertools.pairwise(found), 2)
            if old.pulse_id != new.pulse_id
        ]
        assert changes == [100, 200, 300, 400, 500]

    @pytest.mark.parametrize(
        "wrench",
        [
            {"force_x_n": 0.2, "force_y_n": 0.0, "torque_nm": 0.0},
            {"force_x_n": -0.1, "force_y_n": 0.3, "torque_nm": 0.0},
            {"force_x_n": 0.0, "force_y_n": 0.0, "torque_nm": -0.02},
        ],
    )
    def test_it_is_what_was_asked_for_from_nothing_carried_over(self, flying, wrench):
        asked = BodyWrench((wrench["force_x_n"], wrench["force_y_n"]), wrench["torque_nm"])
        for _ in range(2):
            list(flying.receive(push(**wrench), 0))
            assert tick(flying, 0).on_time_ms == bytes(modulator().update(asked).on_time_ms)

    def test_it_is_refused_unless_it_flies(self, mux):
        (ack,) = mux.receive(push(), 0)
        assert not ack.accepted
        assert ack.reason == "only a flying vehicle can be pushed, it is waiting for its supervisor"
        rule(mux, 0, "brake")
        (ack,) = mux.receive(push(), 0)
        assert ack.reason == "only a flying vehicle can be pushed, it is braking"
        assert tick(mux, 20).source == "closed"

    def test_it_needs_an_end(self, flying):
        (ack,) = flying.receive(push(span_s=3600.0), 0)
        assert isinstance(ack, Ack)
        assert not ack.accepted
        assert "span_s is 3600, expected 0 to 10" in ack.reason

    def test_resume_ends_it(self, flying):
        list(flying.receive(push(span_s=5.0), 0))
        assert tick(flying, 20).source == "operator"
        assert list(flying.receive(request("resume"), 30 * MS)) == []
        give(flying, 400, NO_WRENCH)
        assert tick(flying, 400).source == "controller"

    def test_a_change_of_the_law_ends_it(self, flying):
        list(flying.receive(push(span_s=5.0), 0))
        rule(flying, 20, "closed")
        rule(flying, 40, "controller")
        assert tick(flying, 60).source == "closed"

    def test_a_repeated_ruling_does_not(self, flying):
        list(flying.receive(push(span_s=5.0), 0))
        rule(flying, 20, "controller")
        assert tick(flying, 40).source == "operator"

    def test_other_requests_are_not_its_business(self, flying):
        assert list(flying.receive(request("stop"), 0)) == []
        assert list(flying.receive(request("arm"), 0)) == []


class TestOutside:
    """A program outside the station, anna's, commands."""

    @pytest.fixture
    def outside(self, flying):
        self.lease(flying, 0)
        list(flying.receive(state(0), 0))
        return flying

    def lease(self, mux, now_ms, holder="anna", until_ms=100_000):
        return list(mux.receive(Lease(now_ms * MS, "", holder, until_ms * MS, ""), now_ms * MS))

    def send(self, mux, now_ms, push=PUSH, author="anna", number=1, waited_ms=0):
        stamp_ns = (now_ms - waited_ms) * MS
        wrench = OutsideWrench(stamp_ns, "alpha", author, number, push.force_body_n, push.torque_nm)
        return list(mux.receive(wrench, now_ms * MS))

    def refusal(self, messages):
        [ack] = messages
        assert (ack.action, ack.accepted) == ("wrench", False)
        return ack.reason

    def controls(self, mux, now_ms):
        return [each for each in mux.tick(now_ms * MS) if isinstance(each, OutsideControl)]

    def fly(self, mux, begin_ms, end_ms, every_ms=20):
        """Wrenches of the program and ticks for a while; the selections of the ticks."""
        found = []
        for now_ms in range(begin_ms, end_ms, 20):
            rule(mux, now_ms, "controller")
            list(mux.receive(state(now_ms * MS), now_ms * MS))
            if now_ms % every_ms == 0:
                self.send(mux, now_ms)
            found.append(tick(mux, now_ms))
        return found

    def test_the_first_wrench_takes_the_vehicle_at_once_and_is_answered(self, outside):
        give(outside, 0)
        made = self.send(outside, 10, number=7)
        selection = selected(made)
        assert (selection.source, selection.on_time_ms) == ("outside", pulses(PUSH)[0])
        [ack] = [each for each in made if isinstance(each, Ack)]
        assert (ack.accepted, ack.author, ack.request_id, ack.action) == (True, "anna", 7, "wrench")
        [control] = self.controls(outside, 20)
        assert (control.author, control.is_silent) == ("anna", False)
        give(outside, 30)
        assert tick(outside, 40).source == "outside"

    @pytest.mark.parametrize(
        ("holder", "until_ms", "reason"),
        [
            ("", 0, "nobody holds control: ask for it with take_control"),
            ("otto", 60_000, "control is held by otto for another 0:01:00; ask for it with take_control"),
            ("otto", 5, "otto has not given control back: take it with take_control and force"),
            ("anna", 10, "its lease has expired: ask for it with take_control"),
        ],
    )
    def test_who_does_not_hold_the_lease_commands_nothing(self, outside, holder, until_ms, reason):
        self.lease(outside, 0, holder, until_ms)
        give(outside, 0)
        assert self.refusal(self.send(outside, 10)) == reason
        assert tick(outside, 20).source == "controller"

    def test_refusals_are_answered_once_a_second(self, outside):
        answers = [bool(self.send(outside, now_ms, author="otto")) for now_ms in range(0, 2001, 10)]
        assert [10 * place for place, answered in enumerate(answers) if answered] == [0, 1000, 2000]

    @pytest.mark.parametrize("law", ["brake", "closed"])
    def test_it_takes_only_a_vehicle_that_the_controller_flies(self, outside, law):
        rule(outside, 0, law)
        assert self.refusal(self.send(outside, 10)) == "only a flying vehicle can be commanded"
        assert tick(outside, 20).source == law

    def test_there_is_one_pulse_a_period_whatever_it_sends_and_the_newest_counts(self, outside):
        demands = []
        for now_ms in range(400):
            made = self.send(outside, now_ms, BodyWrench((1e-4 * now_ms, 0.0), 0.0))
            if now_ms % 20 == 0:
                rule(outside, now_ms, "controller")
                made += outside.tick(now_ms * MS)
            demands += [each for each in made if isinstance(each, ValveDemand)]
        assert [demand.stamp_ns // MS for demand in demands] == [0, 100, 200, 300]
        wanted = [demand.wanted_force_body_n[0] for demand in demands]
        assert wanted == pytest.approx([0.0, 0.01, 0.02, 0.03])

    def test_a_wrench_lasts_until_the_next_one_or_until_it_is_stale(self, outside):
        sources = [s.source for s in self.fly(outside, 0, 1000, every_ms=200)]
        assert set(sources) == {"outside"}
        self.send(outside, 1000)
        pulse_ids = []
        for now_ms in range(1000, 1240, 20):
            rule(outside, now_ms, "controller")
            pulse_ids.append(tick(outside, now_ms).pulse_id)
        assert len(set(pulse_ids)) == 3

    def test_its_silence_brakes_within_a_quarter_of_a_second_and_is_reported(self, outside):
        self.fly(outside, 0, 100)  # the last one at 80
        list(outside.receive(state(300 * MS, velocity=(0.05, 0.0)), 300 * MS))
        rule(outside, 300, "controller")
        give(outside, 310)  # the controller waits
        assert tick(outside, 320).source == "outside"
        [*_, control] = outside.tick(340 * MS)
        assert isinstance(control, OutsideControl)
        assert (control.author, control.is_silent, control.reason) == ("anna", True, "no wrench for 260 ms")
        silent = tick(outside, 360)
        assert (silent.source, silent.reason) == ("brake", "outside silent for 280 ms")
        assert any(silent.on_time_ms)

    def test_it_is_heard_while_the_supervisor_brakes_and_flies_on_after_that(self, outside):
        self.fly(outside, 0, 100)
        assert self.controls(outside, 400)[0].is_silent
        rule(outside, 420, "brake")
        self.send(outside, 440)
        assert tick(outside, 440).source == "brake"
        assert [control.is_silent for control in self.controls(outside, 450)] == []
        rule(outside, 460, "controller")
        assert tick(outside, 460).source == "outside"

    def test_a_wrench_that_has_waited_is_judged_by_its_arrival(self, outside):
        assert self.refusal(self.send(outside, 500, waited_ms=241)) == "it has waited for 241 ms"
        rule(outside, 500, "controller")
        self.send(outside, 510, waited_ms=240)
        assert tick(outside, 520).source == "brake"  # of the controller: nothing has come, either

    def test_a_stamp_ahead_of_its_time_makes_nothing_fresh_for_longer(self, outside):
        self.send(outside, 0, waited_ms=-1000)
        rule(outside, 300, "controller")
        list(outside.receive(state(300 * MS), 300 * MS))
        assert tick(outside, 300).source == "brake"

    def resume(self, mux, now_ms, author="anna"):
        asked = Request(now_ms * MS, "alpha", 3, author, "resume", "{}")
        return list(mux.receive(asked, now_ms * MS))

    def test_resume_gives_the_vehicle_to_the_controller_and_a_program_that_goes_on_is_not_heard(
        self, outside
    ):
        self.fly(outside, 0, 100)
        self.resume(outside, 100)
        give(outside, 100)
        [control] = self.controls(outside, 100)
        assert tick(outside, 120).source == "controller"
        assert (control.author, control.is_silent, control.reason) == ("", False, "resumed by anna")
        assert self.refusal(self.send(outside, 1080)).startswith("a person has taken the vehicle back")
        self.send(outside, 2070)  # too soon again
        rule(outside, 3070, "controller")
        assert selected(self.send(outside, 3070)).source == "outside"

    def test_resume_of_somebody_who_may_not_changes_nothing(self, outside):
        self.fly(outside, 0, 100)
        self.resume(outside, 100, author="otto")
        assert tick(outside, 100).source == "outside"

    @pytest.mark.parametrize(("holder", "whom"), [("otto", "otto"), ("", "nobody")])
    def test_with_the_lease_goes_the_vehicle(self, outside, holder, whom):
        self.fly(outside, 0, 100)
        self.lease(outside, 100, holder)
        give(outside, 100)
        assert self.controls(outside, 100)[0].reason == f"control went to {whom}"
        assert tick(outside, 120).source == "controller"

    def test_an_expired_lease_brakes_and_waits(self, outside):
        self.lease(outside, 0, until_ms=100)
        self.fly(outside, 0, 460)
        give(outside, 460)
        assert tick(outside, 460).source == "brake"
        self.lease(outside, 460)
        rule(outside, 480, "controller")
        assert selected(self.send(outside, 480)).source == "outside"

    def test_an_expired_lease_is_the_reason_of_its_silence(self, outside):
        self.lease(outside, 0, until_ms=100)
        self.send(outside, 0)
        self.controls(outside, 0)
        self.send(outside, 200)
        assert "lease has expired" in self.controls(outside, 300)[0].reason

    def test_closed_valves_end_it(self, outside):
        self.fly(outside, 0, 100)
        rule(outside, 100, "closed")
        assert self.controls(outside, 100)[0].author == ""
        rule(outside, 120, "controller")
        give(outside, 120)
        assert tick(outside, 120).source == "controller"

    def test_an_operators_push_outranks_it_and_it_goes_on(self, outside):
        self.fly(outside, 0, 100)
        list(outside.receive(Request(0, "alpha", 1, "anna", "push", push().arguments), 100 * MS))
        assert {s.source for s in self.fly(outside, 100, 400)} == {"operator"}
        assert self.fly(outside, 400, 800)[-1].source == "outside"

    def test_it_passes_the_filter(self, outside):
        list(outside.receive(state(0, position=(1.79, 0.0), velocity=(0.02, 0.0)), 0))
        made = self.send(outside, 0, BodyWrench((0.2, 0.0), 0.0))
        [demand_] = [each for each in made if isinstance(each, ValveDemand)]
        assert demand_.source == "outside"
        assert demand_.limited_by
        assert demand_.delivered_force_body_n[0] < 0.0


def test_its_period(mux):
    assert mux.tick_period_ns == 20 * MS


class TestValvesThatFailed:
    def test_the_next_pulses_do_without_them(self, flying):
        give(flying, 5)
        list(flying.receive(ValveShares(0, "alpha", (0.0, *[1.0] * 7), (0.0,) * 8), 50 * MS))
        selection = give(flying, 105)
        assert selection.on_time_ms[0] == 0
        assert selection.on_time_ms[1] > pulses(PUSH)[0][1]  # the other one of its face pushes for both

    def test_braking_counts_on_what_is_left(self, flying):
        list(flying.receive(state(0, (1.0, 0.0), (0.1, 0.0)), 0))
        list(flying.receive(ValveShares(0, "alpha", (0.0, *[1.0] * 7), (0.0,) * 8), 0))
        found = [each for step in range(1, 6) for each in flying.tick(step * 20 * MS)]
        [outlook] = [each for each in found if isinstance(each, Outlook)]
        braking_m_s2 = 0.9 * 0.22 / 11.0 - 0.005
        assert outlook.stopping_distance_m == pytest.approx(0.1 * (0.15 + 0.1 / (2.0 * braking_m_s2)))


class TestFilter:
    def made(self, mux, now_ms, push=PUSH):
        """What was published for a wrench: the pulses with what became of the wish."""
        [made] = [each for each in mux.receive(demand(push), now_ms * MS) if isinstance(each, ValveDemand)]
        return made

    def test_what_is_safe_is_not_changed(self, flying):
        list(flying.receive(state(0, (0.5, 0.5)), 0))
        made = self.made(flying, 5)
        assert (made.source, made.limited_by) == ("controller", "")
        assert made.wanted_force_body_n == PUSH.force_body_n
        expected = modulator().update(PUSH).delivered
        assert made.delivered_force_body_n == expected.force_body_n

    @pytest.mark.parametrize("source", ["controller", "operator"])
    def test_nobody_pushes_it_over_the_edge(self, flying, source):
        list(flying.receive(state(0, (1.78, 0.0), (0.05, 0.0)), 0))
        if source == "operator":
            list(flying.receive(push(span_s=2.0), 0))
            [made] = [each for each in flying.tick(0) if isinstance(each, ValveDemand)]
        else:
            made = self.made(flying, 5)
        assert (made.source, made.limited_by) == (source, "edge")
        assert made.delivered_force_body_n[0] < -0.05

    def test_nor_into_another_mock_up(self, flying):
        list(flying.receive(state(0, velocity=(0.03, 0.0)), 0))
        assert self.made(flying, 5).limited_by == ""
        list(flying.receive(state(0, (0.45, 0.0), vehicle="beta"), 0))
        made = self.made(flying, 105)
        assert made.limited_by == "beta"
        assert made.delivered_force_body_n[0] < -0.05

    def test_one_that_was_never_placed_is_nowhere(self, flying):
        list(flying.receive(state(0), 0))
        list(flying.receive(state(0, (0.45, 0.0), vehicle="beta", status="starting"), 0))
        assert self.made(flying, 5).limited_by == ""

    def test_the_outlook_is_published_ten_times_a_second(self, flying):
        list(flying.receive(state(0, (1.0, 0.0), (0.1, 0.0)), 0))
        list(flying.receive(state(0, (1.7, 0.0), vehicle="beta"), 0))
        found = [each for step in range(1, 51) for each in flying.tick(step * 20 * MS)]
        outlooks = [each for each in found if isinstance(each, Outlook)]
        assert len(outlooks) == 10
        first = outlooks[0]
        braking_m_s2 = 0.9 * 0.44 / 11.0 - 0.005
        stopping_m = 0.1 * (0.15 + 0.1 / (2.0 * braking_m_s2))
        assert first.time_to_edge_s == pytest.approx(8.0)
        assert first.stopping_distance_m == pytest.approx(stopping_m)
        assert first.edge_room_m == pytest.approx(0.8 - stopping_m)
        assert first.nearest == "beta"
        assert first.nearest_room_m == pytest.approx(0.7 - 0.4 - stopping_m)
