"""Planning a reconfiguration: first guesses, rounds until they settle, and the look at what came out."""

import itertools
import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from groundstation.control.convex_rounds import Rounds
from groundstation.control.spline import ENDS, Array, RestToRest
from groundstation.control.trajectories import NoSafeWayError, Plan, Reconfiguration, shortest_s
from groundstation.control.trajectory_check import objection

_SPANS = 16
_ROUNDS = 20
_SETTLED_M = 0.01  # a safe round that moved no control point farther is the last one
_ENOUGH_ROUNDS = (
    7  # rounds can chatter between who closes in and who does not: then the best safe one is taken
)
_MISSING_M = 1e-3
_BOWS = (0.30, -0.30, 0.0)  # of the way's length, to the right of it; tried in this order
_LONGER = (1.0, 1.3, 1.7)  # of the duration, where none is given


@lru_cache(maxsize=16)
def plan(asked: Reconfiguration) -> Plan:
    """Ways from rest to rest on which nobody meets.

    Raises:
        NoSafeWayError: Starts or goals are too near to each other, to an obstacle or to the edge, or no way
            was found that is safe; the sentence says which.
    """
    _check(asked)
    if asked.duration_s is not None:
        durations_s = [asked.duration_s]
    else:
        durations_s = [share * shortest_s(asked) for share in _LONGER]
    reason = ""
    for duration_s, bow in itertools.product(durations_s, _BOWS):
        made, reason = _from_guess(asked, RestToRest(duration_s, _SPANS), bow)
        if made is not None:
            return made
    raise NoSafeWayError(
        f"no safe way was found within {durations_s[-1]:.0f} s: {reason}; give more time, or other places"
    )


def straight_or_planned(asked: Reconfiguration) -> Plan:
    """Straight ways where they are safe, which takes milliseconds, otherwise as `plan`.

    Raises:
        NoSafeWayError: See `plan`.
    """
    _check(asked)
    family = RestToRest(asked.duration_s or shortest_s(asked), _SPANS)
    straight = Plan(family, _guess(asked, family, 0.0))
    return plan(asked) if objection(asked, straight) else straight


def _from_guess(asked: Reconfiguration, family: RestToRest, bow: float) -> tuple[Plan | None, str]:
    """A safe plan, or why none came of this guess."""
    rounds, control_m, reason = Rounds(asked, family), _guess(asked, family, bow), ""
    best: Plan | None = None
    for number in range(_ROUNDS):
        solved = rounds.solved(control_m)
        if solved is None:
            return best, "speed and acceleration do not allow it"
        moved_m = float(np.abs(solved[0] - control_m).max())
        control_m, missing_m = solved
        if missing_m > _MISSING_M:
            reason = f"{1e3 * missing_m:.0f} mm of room are missing"
            continue
        made = Plan(family, control_m)
        reason = objection(asked, made)
        if not reason and (best is None or made.effort < best.effort):
            best = made
        if best is not None and (moved_m < _SETTLED_M or number >= _ENOUGH_ROUNDS):
            break
    return best, reason


def _guess(asked: Reconfiguration, family: RestToRest, bow: float) -> Array:
    """Straight ways from rest to rest, bowed to the right by a share of their length."""
    share = family.centres_s / family.duration_s
    share = np.clip((share - share[ENDS - 1]) / (share[-ENDS] - share[ENDS - 1]), 0.0, 1.0)
    along = share**2 * (3.0 - 2.0 * share)
    starts, goals = np.array(asked.starts_m, float), np.array(asked.goals_m, float)
    ways = goals - starts
    right = np.column_stack([ways[:, 1], -ways[:, 0]])
    control_m: Array = (
        starts[:, None]
        + along[None, :, None] * ways[:, None]
        + bow * np.sin(math.pi * along)[None, :, None] * right[:, None]
    )
    return control_m


def _check(asked: Reconfiguration) -> None:
    """Starts and goals have room; the sentence is about them, not about ways."""
    if len(asked.starts_m) != len(asked.goals_m):
        raise NoSafeWayError(f"{len(asked.starts_m)} starts need as many goals, found {len(asked.goals_m)}")
    standing = RestToRest(1.0, _SPANS)
    for word, places_m in (("starts", asked.starts_m), ("goals", asked.goals_m)):
        if not np.isfinite(np.array(places_m, float)).all():
            raise NoSafeWayError(f"the {word} must be at finite positions")
        still = replace(asked, starts_m=places_m, goals_m=places_m)
        reason = objection(still, Plan(standing, _guess(still, standing, 0.0)))
        if reason:
            raise NoSafeWayError(f"the {word} are no places to rest at: {reason.partition(' at ')[0]}")
