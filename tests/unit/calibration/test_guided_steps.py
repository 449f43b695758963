"""What a driven step begins with, as the vehicle is by then."""

import pytest

from calibration.guided_steps import GuidedSteps
from groundstation.control.keep_in import KeepIn
from groundstation.declarations.guide import Goal, Step
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.supervision.messages import Supervision
from groundstation.supervision.mode_machine import Then

TABLE = KeepIn(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))
GOALS = (Goal("enough", 1.0, "", is_amount=True),)
REST, FLY = Step("rest", "", True, GOALS, 99.0), Step("fly", "", False, GOALS, 99.0)
HAND = Step("hand", "", False, GOALS, 99.0, is_by_hand=True)


def ruled(mode, *, flight_wanted=False, author=""):
    return Supervision(
        0, "alpha", mode, "closed", False, False, False, 0.0, flight_wanted, int(Then.FLY), "because",
        author, 0, (), (),
    )  # fmt: skip


def begun(step, ruling):
    steps = GuidedSteps("alpha", TABLE, (step,), {"fly": lambda number, home: (0.1 * number, 5.0, 0.0)})
    steps.take(ruling)
    steps.advice(0.0, {})
    return steps


@pytest.mark.parametrize(
    ("step", "mode", "flight_wanted", "wanted"),
    [
        (REST, "flying", True, ["land"]),
        (FLY, "landed", False, ["fly"]),
        (FLY, "flying", True, []),
        (FLY, "holding", True, ["resume"]),
        (FLY, "landing", False, []),
        (HAND, "landed", False, ["float_on"]),
        (HAND, "floating", False, []),
        (HAND, "flying", True, ["land"]),
    ],
)
def test_a_step_begins_with_what_the_vehicle_does_not_do_yet(step, mode, flight_wanted, wanted):
    steps = begun(step, ruled(mode, flight_wanted=flight_wanted))
    assert [action for action, _ in steps.requests(0.0)] == wanted
    assert not list(steps.requests(0.1))  # asked once


def test_a_flying_vehicle_is_landed_before_a_hand_turns_it():
    steps = begun(HAND, ruled("flying", flight_wanted=True))
    assert [action for action, _ in steps.requests(0.0)] == ["land"]
    steps.answer("land", "")
    steps.take(ruled("landing"))
    assert not list(steps.requests(1.0))
    steps.take(ruled("landed"))
    assert [action for action, _ in steps.requests(2.0)] == ["float_on"]
    assert not steps.trouble()
    assert not list(steps.requests(20.0))  # it is sent nowhere


def test_goals_stay_on_the_table_and_come_one_by_one():
    steps = begun(FLY, ruled("flying", flight_wanted=True))
    steps.take(VehicleState(1, "alpha", (0.0, 0.0), 0.0, (0.0, 0.0), 0.0, (0.1, 0.1, 0.1), "flying", 0))
    goals = [
        goal for second in range(30) for action, goal in steps.requests(float(second)) if action == "go_to"
    ]
    assert len(goals) == 3
    assert all(goal["y_m"] < 1.0 for goal in goals)


def test_a_person_who_lands_it_ends_it_but_not_what_a_hand_moves():
    steps = begun(FLY, ruled("flying", flight_wanted=True))
    list(steps.requests(0.0))
    steps.take(ruled("landed", author="anna"))
    assert "by anna" in steps.trouble()
    by_hand = begun(HAND, ruled("floating"))
    list(by_hand.requests(0.0))
    by_hand.take(ruled("landed", author="anna"))
    assert not by_hand.trouble()
