"""The shell of the multiplexer: who commands by the supervisor's ruling, filtered, as pulses; by messages."""

import itertools

import pytest
from unit.groundstation.parts.valves.multiplexer import (
    MODEL,
    MS,
    PUSH,
    demand,
    give,
    modulator,
    pulses,
    push,
    request,
    rule,
    ruling,
    state,
    tick,
)

from groundstation.control.brake import BrakeConfig, brake_wrench, dead_reckoned
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.declarations.request import Ack
from groundstation.parts.supervision.messages import ValveShares
from groundstation.parts.valves.messages import Outlook, ValveDemand


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
