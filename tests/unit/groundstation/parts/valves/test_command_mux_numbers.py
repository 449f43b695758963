"""Every field of what the multiplexer publishes, its limits and who is heard; numbers by hand."""

import math
from dataclasses import fields

import pytest
from unit.groundstation.parts.valves.multiplexer import (
    MODEL,
    MS,
    demand,
    give,
    modulator,
    push,
    request,
    rule,
    ruling,
    state,
    tick,
)

from groundstation.control.brake import BrakeConfig, brake_wrench
from groundstation.control.safety_filter import body_force
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState
from groundstation.control.station import StationConfig, StationKeeping
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.declarations.lease import Lease
from groundstation.declarations.request import Ack, Request
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.outside.messages import OutsideWrench
from groundstation.parts.supervision.messages import Supervision, ValveShares
from groundstation.parts.valves.command_mux_node import CommandMuxNode
from groundstation.parts.valves.hand_push import HandPush
from groundstation.parts.valves.messages import Outlook, ValveDemand, ValveSelection

BRAKING_M_S2 = 0.9 * 0.44 / 11.0 - 0.005
ENVELOPE = WrenchEnvelope(MODEL)


def values(message):
    return [getattr(message, each.name) for each in fields(message)]


def of(kind, messages):
    return [each for each in messages if isinstance(each, kind)]


def made(mux, now_ms, force=(0.1, 0.0), torque=0.0):
    """What a wrench of the controller became."""
    [found] = of(ValveDemand, mux.receive(demand(BodyWrench(force, torque)), now_ms * MS))
    return found


def see(mux, *args, **words):
    list(mux.receive(state(*args, **words), args[0]))


def own(sigma_m, position=(0.0, 0.0)):
    return VehicleState(0, "alpha", position, 0.0, (0.0, 0.0), 0.0, (*sigma_m, 1e-3), "flying", 1)


def test_who_is_heard(mux):
    assert CommandMuxNode.inputs == (
        Wrench, OutsideWrench, VehicleState, Supervision, ValveShares, Request, Lease,
    )  # fmt: skip
    assert mux.sources(VehicleState) == ("alpha", "beta")
    for kind in (Wrench, OutsideWrench, Supervision, ValveShares, Request, Lease):
        assert mux.sources(kind) == ("alpha",)


class TestFields:
    def test_the_first_selection_and_those_after_it(self, mux):
        reason = "nothing comes from the supervisor"
        for counter in (1, 2):
            [found] = mux.tick(20 * counter * MS)
            assert values(found) == [20 * counter * MS, "alpha", counter, 1, bytes(8), "closed", reason]

    def test_a_demand(self, flying):
        wish = BodyWrench((0.1, -0.05), 0.004)
        expected = modulator().update(wish)
        demanded, selected = flying.receive(demand(wish), 5 * MS)
        on = bytes(expected.on_time_ms)
        assert isinstance(demanded, ValveDemand)
        assert values(demanded) == [
            5 * MS,
            "alpha",
            on,
            "controller",
            (0.1, -0.05),
            0.004,
            "",
            expected.delivered.force_body_n,
            expected.delivered.torque_nm,
        ]
        assert values(selected)[:1] + values(selected)[4:] == [
            5 * MS,
            on,
            "controller",
            "controller is fresh",
        ]

    def test_an_outlook(self, flying):
        see(flying, 0, (1.0, 0.2), (0.1, 0.0))
        see(flying, 0, (1.6, 0.2), (-0.05, 0.0), vehicle="beta")
        found = [(step, each) for step in range(1, 16) for each in of(Outlook, flying.tick(step * 20 * MS))]
        assert [step for step, _ in found] == [5, 10, 15]
        stopping_m = 0.1 * (0.15 + 0.1 / (2.0 * BRAKING_M_S2))
        theirs_m = 0.05 * (0.15 + 0.05 / (2.0 * BRAKING_M_S2))
        assert values(found[0][1]) == [
            100 * MS,
            "alpha",
            pytest.approx(8.0),
            pytest.approx(stopping_m),
            pytest.approx(0.8 - stopping_m),
            "beta",
            # the other one is carried on for 0.1 s
            pytest.approx(0.595 - 0.4 - stopping_m - theirs_m),
            "",
        ]

    def test_an_outlook_says_what_is_limited(self, flying):
        see(flying, 0, (1.79, 0.0), (0.01, 0.0))
        made(flying, 5)
        [outlook] = [each for step in range(5) for each in of(Outlook, flying.tick((10 + step) * MS))]
        assert outlook.limited_by == "edge"

    def test_without_a_state_there_is_no_outlook(self, flying_blind):
        assert [each for step in range(10) for each in of(Outlook, flying_blind.tick(step * MS))] == []

    def test_without_valves_a_millionth_is_counted_on(self, flying):
        see(flying, 0, (0.0, 0.0), (1e-3, 0.0))
        see(flying, 0, (1.0, 0.0), vehicle="beta")
        list(flying.receive(ValveShares(0, "alpha", (0.0,) * 8, (0.0,) * 8), 0))
        [outlook] = [each for step in range(5) for each in of(Outlook, flying.tick(step * MS))]
        assert outlook.nearest_room_m == pytest.approx(0.6 - 1e-3 * (0.15 + 1e-3 / 2e-6))


@pytest.fixture
def flying_blind(mux):
    list(mux.receive(ruling("controller"), 0))
    return mux


class TestHeard:
    def test_a_ruling_holds_half_a_second(self, flying):
        give(flying, 490)
        assert tick(flying, 500).source == "controller"
        late = flying.tick(500 * MS + 1)
        assert of(ValveSelection, late)[0].reason == "nothing comes from the supervisor"

    def test_braking_closes_by_itself_when_the_ruling_is_too_old(self, flying):
        see(flying, 0, velocity=(0.05, 0.0))
        rule(flying, 0, "brake")
        assert tick(flying, 500).source == "brake"
        assert tick(flying, 501).source == "closed"

    def test_states_of_others_are_no_own_states(self, flying_blind):
        see(flying_blind, 0, (0.5, 0.0), vehicle="beta")
        found = made(flying_blind, 5)
        assert (found.limited_by, found.delivered_force_body_n) == ("no state", (0.0, 0.0))
        assert rule(flying_blind, 10, "brake")[0].source == "closed"

    @pytest.mark.parametrize("status", ["resting", "lost"])
    def test_others_are_placed_while_they_rest_or_are_lost(self, flying, status):
        see(flying, 0)
        see(flying, 0, (0.42, 0.0), vehicle="beta", status=status)
        assert made(flying, 5).limited_by == "beta"

    def test_who_flies_keeps_to_half(self, flying):
        # 0.7 m apart, it comes at 0.1 m/s: for the whole of the condition it is too near
        see(flying, 0)
        way_m = 0.1 * (0.15 + 0.8 + 0.1 / (2.0 * 0.85 * BRAKING_M_S2))
        place = (0.42 + math.hypot(0.003, 0.003) * 2**0.5 + way_m + 0.05, 0.0)
        see(flying, 0, place, (-0.1, 0.0), vehicle="beta")
        assert made(flying, 5, (0.1, 0.0)).limited_by == ""
        see(flying, 0, place, (-0.1, 0.0), vehicle="beta", status="resting")
        assert made(flying, 105, (0.1, 0.0)).limited_by == "beta"

    def test_the_doubt_of_the_own_place_counts(self, flying):
        see(flying, 0, (0.55, 0.0), vehicle="beta")
        list(flying.receive(own((1e-3, 1e-3)), 0))
        assert made(flying, 5).limited_by == ""
        list(flying.receive(own((0.04, 0.03)), 0))
        assert made(flying, 105).limited_by == "beta"

    def test_the_doubt_across_counts_and_that_of_the_heading_does_not(self, flying):
        see(flying, 0, (0.55, 0.0), vehicle="beta")
        words = (0, "alpha", (0.0, 0.0), 0.0, (0.0, 0.0), 0.0)
        list(flying.receive(VehicleState(*words, (1e-3, 1e-3, 9.0), "flying", 1), 0))
        assert made(flying, 5).limited_by == ""
        list(flying.receive(VehicleState(*words, (1e-3, 0.05, 1e-3), "flying", 1), 0))
        assert made(flying, 105).limited_by == "beta"


class TestFilter:
    def test_what_is_changed_is_the_force_in_body_axes(self, flying):
        heading_rad = 0.7
        see(flying, 0, (1.79, 0.0), heading_rad=heading_rad)
        found = made(flying, 5, (0.3, 0.1), 0.02)
        # at rest: u_x <= 0.01 / 0.95, u_y as wanted; the torque is a quarter of the largest at most
        wanted = ENVELOPE.saturate(BodyWrench((0.3, 0.1), 0.02))
        fx, fy = wanted.force_body_n
        across = (math.sin(heading_rad) * fx + math.cos(heading_rad) * fy) / 11.0
        force = body_force((0.01 / 0.95, across), heading_rad, 11.0)
        torque = min(wanted.torque_nm, 0.25 * ENVELOPE.max_torque_nm)
        expected = modulator().update(ENVELOPE.saturate(BodyWrench(force, torque)))
        assert found.delivered_force_body_n == pytest.approx(expected.delivered.force_body_n, abs=1e-3)
        assert found.delivered_torque_nm == pytest.approx(expected.delivered.torque_nm, abs=1e-4)
        assert found.limited_by == "edge"

    def test_torque_gives_way_while_the_force_is_changed(self, flying):
        see(flying, 0, (1.79, 0.0))
        made(flying, 5, (0.3, 0.0), 0.06)
        found = made(flying, 105, (0.3, 0.0), 0.06)
        assert found.delivered_torque_nm < 0.3 * ENVELOPE.max_torque_nm

    @pytest.mark.parametrize(("rate_rad_s", "torque_nm"), [(0.75, 0.25 * 0.1), (0.81, -0.25 * 0.02)])
    def test_nobody_turns_it_too_fast(self, flying, rate_rad_s, torque_nm):
        # room: (0.8 - rate) / 0.5 s
        see(flying, 0, rate_rad_s=rate_rad_s)
        found = made(flying, 5, (0.05, 0.0), 0.05)
        expected = modulator().update(BodyWrench((0.05, 0.0), torque_nm))
        assert found.limited_by == "turn rate"
        assert found.delivered_force_body_n == pytest.approx(expected.delivered.force_body_n)
        assert found.delivered_torque_nm == pytest.approx(expected.delivered.torque_nm)

    def test_edge_and_turn_rate_are_both_named(self, flying):
        see(flying, 0, (1.79, 0.0), rate_rad_s=0.75)
        assert made(flying, 5, (0.3, 0.0), 0.05).limited_by == "edge, turn rate"

    def test_too_late_for_less_it_brakes(self, flying):
        known = ControlState((1.6, 0.0), (0.25, 0.0), 0.0, 0.0)
        see(flying, 0, known.position_table_m, known.velocity_table_m_s)
        found = made(flying, 5)
        expected = modulator().update(brake_wrench(known, BrakeConfig(), MODEL, ENVELOPE))
        assert found.delivered_force_body_n == expected.delivered.force_body_n
        assert (found.source, found.limited_by) == ("controller", "edge")
        assert found.wanted_force_body_n == (0.1, 0.0)

    def test_what_is_safe_is_not_shortened_before_it_is_shared(self, flying):
        """More than the valves can make is the modulator's affair."""
        see(flying, 0)
        found = made(flying, 5, (0.9, 0.0), 0.0)
        assert (
            found.delivered_force_body_n
            == modulator().update(BodyWrench((0.9, 0.0), 0.0)).delivered.force_body_n
        )
        assert found.limited_by == ""

    def test_the_brake_is_not_filtered_and_the_place_that_is_held_is(self, flying):
        see(flying, 0, (1.79, 0.0), (0.1, 0.0))
        list(flying.receive(ruling("brake"), 0))
        [braking] = of(ValveDemand, flying.tick(100 * MS))
        assert (braking.source, braking.limited_by) == ("brake", "")
        # beta comes at 0.07 m/s to 0.55 m: half of what is missing is made way for
        see(flying, 200 * MS, (0.0, 0.0))
        see(flying, 200 * MS, (0.55, 0.0), (-0.07, 0.0), vehicle="beta")
        [holding] = of(ValveDemand, flying.tick(200 * MS))
        assert (holding.source, holding.limited_by) == ("brake", "beta")
        assert holding.delivered_force_body_n[0] < -0.1

    def test_a_place_is_held_off_the_edge(self, flying):
        known = ControlState((1.78, 0.0), (0.0, 0.0), 0.0, 0.0)
        see(flying, 0, known.position_table_m)
        [holding] = of(ValveDemand, flying.receive(ruling("brake"), 0))
        station = StationKeeping(StationConfig(), MODEL)
        flying._braking.take(known, 0)
        assert flying._braking.held.position_table_m == pytest.approx((1.74, 0.0))
        expected = station.update(known, flying._braking.held, 0.1, applied=NO_WRENCH)
        assert holding.wanted_force_body_n == pytest.approx(expected.force_body_n)
        assert holding.wanted_torque_nm == pytest.approx(expected.torque_nm)

    def test_what_limited_one_source_is_not_said_of_the_next(self, flying):
        see(flying, 0, (1.79, 0.0))
        made(flying, 5)
        list(flying.receive(ruling("brake"), 10 * MS))
        see(flying, 11 * MS, (0.0, 0.0), (0.1, 0.0))
        rule(flying, 12, "closed")
        [outlook] = [each for step in range(5) for each in of(Outlook, flying.tick((20 + step) * MS))]
        assert outlook.limited_by == ""


class TestLease:
    def lease(self, mux, holder="anna", expires_ms=1000):
        list(mux.receive(Lease(0, "rig", holder, expires_ms * MS, ""), 0))

    def test_another_operator_may_not_push_before_it_ends(self, flying):
        self.lease(flying)
        [ack] = flying.receive(push(), 999 * MS)
        assert ack.accepted is False
        assert "control is held by anna" in ack.reason
        assert tick(flying, 20).source != "operator"
        rule(flying, 1000, "controller")
        [ack] = flying.receive(push(), 1000 * MS)
        assert values(ack) == [1000 * MS, "alpha", 1, "operator", "push", True, ""]

    def test_nor_end_the_push_of_who_holds_control(self, flying):
        self.lease(flying, "operator")
        list(flying.receive(push(span_s=5.0), 0))
        self.lease(flying, "anna")
        assert list(flying.receive(request("resume"), 10 * MS)) == []
        assert tick(flying, 20).source == "operator"
        assert tick(flying, 320).source == "operator"


class TestHandPush:
    def test_every_argument_counts(self, flying):
        see(flying, 0)
        list(flying.receive(push(force_x_n=0.1, force_y_n=-0.07, torque_nm=0.004), 0))
        [found] = of(ValveDemand, flying.tick(0))
        assert (found.wanted_force_body_n, found.wanted_torque_nm) == ((0.1, -0.07), 0.004)
        assert found.source == "operator"

    def test_what_is_due_by_value(self):
        hand = HandPush(100 * MS)
        assert hand.due(0) == (None, False)
        assert hand.begin(push(span_s=0.15), ruling("controller"), 0) == ""
        wrench = BodyWrench((0.2, 0.0), 0.0)
        found = [hand.due(now_ms * MS) for now_ms in (0, 99, 100, 149, 150, 151)]
        assert found == [
            (wrench, False),
            (None, False),
            (wrench, False),
            (None, False),
            (None, True),
            (None, False),
        ]

    def wishes(self, mux, last_ms):
        """When a wish went out, and whether it was a push."""
        found = []
        for now_ms in range(0, last_ms, 20):
            list(mux.receive(ruling("controller"), now_ms * MS))
            found += [
                (now_ms, each.wanted_force_body_n != (0.0, 0.0))
                for each in of(ValveDemand, mux.tick(now_ms * MS))
                if each.source == "operator"
            ]
        return found

    def test_a_period_each_until_its_end_and_then_nothing_once(self, flying):
        see(flying, 0)
        list(flying.receive(push(span_s=0.3), 0))
        assert self.wishes(flying, 800) == [(0, True), (100, True), (200, True), (300, False)]

    def test_a_push_that_ends_between_periods_ends_there(self, flying):
        see(flying, 0)
        list(flying.receive(push(span_s=0.34), 0))
        assert self.wishes(flying, 800) == [
            (0, True), (100, True), (200, True), (300, True), (340, False),
        ]  # fmt: skip

    def test_a_new_push_begins_with_nothing_carried_over(self, flying):
        see(flying, 0)
        wish = BodyWrench((0.011, 0.0), 0.0)  # too little for one pulse
        for now_ms in (0, 20):
            list(flying.receive(push(force_x_n=0.011), now_ms * MS))
            [found] = of(ValveDemand, flying.tick(now_ms * MS))
            assert found.on_time_ms == bytes(modulator().update(wish).on_time_ms)

    def test_a_refused_push_changes_nothing_of_the_one_before(self, flying):
        see(flying, 0)
        wish = BodyWrench((0.012, 0.0), 0.0)
        pulses = modulator()
        expected = [bytes(pulses.update(wish).on_time_ms) for _ in range(2)]
        list(flying.receive(push(force_x_n=0.012), 0))
        [first] = of(ValveDemand, flying.tick(0))
        [ack] = flying.receive(push(span_s=99.0), 10 * MS)
        [second] = of(ValveDemand, flying.tick(100 * MS))
        assert isinstance(ack, Ack)
        assert not ack.accepted
        assert [first.on_time_ms, second.on_time_ms] == expected
