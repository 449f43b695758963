"""A program outside commands through the multiplexer: lease, silence, resume, one pulse a period."""

import pytest
from unit.groundstation.parts.valves.multiplexer import (
    MS,
    PUSH,
    give,
    pulses,
    push,
    rule,
    selected,
    state,
    tick,
)

from groundstation.control.state import BodyWrench
from groundstation.declarations.lease import Lease
from groundstation.declarations.request import Ack, Request
from groundstation.parts.outside.messages import OutsideWrench
from groundstation.parts.valves.messages import OutsideControl, ValveDemand


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
