"""What a guided calibration knows of its vehicle: whether it may begin, waits, rests, or was taken."""

import math

import pytest

from calibration.vehicle_watch import VehicleWatch
from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveStatus
from groundstation.supervision.mode_machine import Then
from groundstation.supervision.modes import Mode


def ruling(mode, *, stopped=False, wanted=True, then=Then.FLY, cause="it may", author="", waits_for=()):
    return Supervision(
        5, "alpha", mode, "closed", False, False, stopped, math.inf, wanted, int(then), cause, author, 5,
        waits_for, (),
    )  # fmt: skip


def status(rest_s):
    return FusionStatus(5, "alpha", "flying", "bias_filter", 0.0, (0.0, 0.0), rest_s, 9, 0, 0.1, (0.0, 0.0))


def valves(*, floating):
    return ValveStatus(5, "alpha", 0, 1, False, False, floating, math.nan, 0, 100.0)


def state():
    return VehicleState(5, "alpha", (0.0, 0.0), 0.0, (0.0, 0.0), 0.0, (1e-3, 1e-3, 1e-3), "flying", 4)


def watch(*messages):
    watched = VehicleWatch("alpha")
    for message in messages:
        watched.take(message)
    return watched


@pytest.mark.parametrize(
    ("messages", "missing"),
    [
        ((), "no state, no valve status, no supervision is received"),
        ((state(),), "no valve status, no supervision"),
        ((valves(floating=False), ruling(Mode.LANDED)), "no state is received"),
    ],
)
def test_it_does_not_begin_before_everything_is_known(messages, missing):
    sentence = watch(*messages).unknown()
    assert sentence.startswith("alpha is not known yet: ")
    assert missing in sentence


def test_it_begins_where_all_is_known_and_nobody_stopped_it():
    known = (state(), valves(floating=False))
    assert watch(*known, ruling(Mode.LANDED)).unknown() == ""
    stopped = watch(*known, ruling(Mode.STOPPED, stopped=True, author="anna"))
    assert stopped.unknown() == "alpha is stopped by anna: release the stop first."


def test_until_the_valve_node_reports_it_may_float_and_nothing_counts_as_rest():
    watched = watch(status(4.0))
    assert watched.floats
    assert watched.rest_s == 0.0
    watched.take(valves(floating=False))
    assert watched.rest_s == 4.0
    watched.take(valves(floating=True))
    assert watched.rest_s == 0.0


@pytest.mark.parametrize("mode", list(Mode))
def test_a_request_to_fly_comes_too_early_only_on_its_way_down(mode):
    assert watch(ruling(mode)).is_on_its_way_down == (mode in (Mode.LANDING, Mode.LOST))


@pytest.mark.parametrize(
    ("given", "is_taken"),
    [
        (ruling(Mode.LANDED, wanted=False), False),
        (ruling(Mode.LANDING, wanted=False), False),
        (ruling(Mode.LOST, wanted=False), False),
        (ruling(Mode.LANDED, wanted=True, author="bob"), True),
        (ruling(Mode.FLOATING, wanted=False, author="bob"), True),
        (ruling(Mode.STOPPED, stopped=True, wanted=False), True),
    ],
)
def test_a_vehicle_that_is_to_rest_is_taken_when_it_is_to_leave_the_table(given, is_taken):
    assert bool(watch(given).taken(is_rest=True)) == is_taken


@pytest.mark.parametrize(
    ("given", "is_taken"),
    [
        (ruling(Mode.FLYING), False),
        (ruling(Mode.RESTING), False),
        (ruling(Mode.BRAKING, then=Then.FLY), False),
        (ruling(Mode.HOLDING, then=Then.HOLD), False),  # the station's own: it may fly on
        (ruling(Mode.HOLDING, then=Then.HOLD, author="bob"), True),
        (ruling(Mode.BRAKING, then=Then.LAND, author="bob"), True),
        (ruling(Mode.LANDED, wanted=False, author="bob"), True),
        (ruling(Mode.BRAKING, stopped=True, author="bob"), True),
    ],
)
def test_a_vehicle_that_is_to_fly_is_taken_when_it_is_held_or_landed(given, is_taken):
    sentence = watch(given).taken(is_rest=False)
    assert bool(sentence) == is_taken
    if is_taken:
        assert "by bob" in sentence
        assert sentence.endswith("the calibration ends.")


def test_before_the_first_ruling_nobody_has_taken_it_and_it_waits():
    watched = watch()
    assert (
        watched.taken(is_rest=True) == watched.taken(is_rest=False) == watched.stopped() == watched.mode == ""
    )
    assert watched.waits() == "waits for its supervisor"


def test_what_it_waits_for_is_told():
    assert watch(ruling(Mode.FLYING)).waits() == ""
    waiting = ruling(Mode.RESTING, waits_for=("3 s of rest are left", "no fix"))
    assert watch(waiting).waits() == "waits until it flies: resting (3 s of rest are left; no fix)"
    assert "(brakes for a fault)" in watch(ruling(Mode.BRAKING, cause="brakes for a fault")).waits()
