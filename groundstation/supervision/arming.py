"""The arming gate: one list of checks, each with a name and a reason when it refuses. Pure."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from groundstation.supervision.apart import too_near
from groundstation.supervision.fault_board import Standing
from groundstation.supervision.faults import Response
from groundstation.supervision.sightings import Sightings

OLDEST_FIX_S = 3.0
AGREEING = 2


@dataclass(frozen=True, slots=True)
class Question:
    """What the checks look at.

    Attributes:
        sightings: What is known.
        standing: Faults of the vehicle.
        rest_s: Length of rest that is asked for.
        now_ns: The moment.
    """

    sightings: Sightings
    standing: tuple[Standing, ...]
    rest_s: float
    now_ns: int


@dataclass(frozen=True, slots=True)
class Check:
    """A row of the gate.

    Attributes:
        name: Named when it refuses.
        summary: What must hold.
        objection: What is wrong; empty if nothing is.
        may_be_overridden: A person may fly in spite of it, with a reason.
    """

    name: str
    summary: str
    objection: Callable[[Question], str]
    may_be_overridden: bool = False


def _heartbeats(question: Question) -> str:
    sightings, now_ns = question.sightings, question.now_ns
    is_imu_dead = any(row.fault.id == "imu_silent" for row in question.standing)
    no_state = "fusion" + (", which gets no IMU samples" if is_imu_dead else "")
    missing = [
        name
        for name, is_missing in (
            ("valve node", sightings.node is None or sightings.is_node_silent(now_ns)),
            ("fault detector", sightings.findings_ns is None),
            ("controller", sightings.placed_ns is not None and sightings.demand_ns is None),
            (no_state, _has_no_state(question) or (sightings.own and sightings.is_state_silent(now_ns))),
        )
        if is_missing
    ]
    return f"nothing comes from {', '.join(missing)}" if missing else ""


def _has_no_state(question: Question) -> bool:
    """Whether nothing came of fusion; one that counts its rest but has no fix yet is alive."""
    return question.sightings.own is None and question.sightings.rest_s <= 0.0


def _rest(question: Question) -> str:
    rest_s = question.sightings.rest_s
    if rest_s >= question.rest_s:
        return ""
    return f"unbroken rest of {rest_s:.1f} s, {question.rest_s:g} s are asked for"


def _fixes(question: Question) -> str:
    own, age_s = question.sightings.own, question.sightings.fix_age_s
    if _has_no_state(question):
        return "they cannot be judged, since nothing comes from fusion"
    if own is None or own.status != "flying":
        return "no agreeing fixes have placed it yet"
    if age_s > OLDEST_FIX_S:
        return f"the newest fix is {age_s:.1f} s old"
    agreeing = question.sightings.agreeing
    return "" if agreeing >= AGREEING else f"{agreeing} fixes agree, {AGREEING} are asked for"


def _pose(question: Question) -> str:
    own = question.sightings.own
    if own is None:
        return ""
    room_m = min(question.sightings.keep_in.edge_distances_m(own.state.position_table_m))
    return "" if room_m >= 0.0 else f"it stands {-1e3 * room_m:.0f} mm outside its part of the table"


def _apart(question: Question) -> str:
    own = question.sightings.own
    if own is None:
        return ""
    for name, other in question.sightings.others_here(question.now_ns).items():
        refusal = too_near(name, math.dist(own.state.position_table_m, other.position_table_m))
        if refusal:
            return refusal
    return ""


def _faults(question: Question) -> str:
    return _names(row for row in question.standing if not row.fault.may_be_overridden)


def _lesser_faults(question: Question) -> str:
    return _names(row for row in question.standing if row.fault.may_be_overridden)


def _names(rows: Iterable[Standing]) -> str:
    """Those that keep it down, and those whose response would land it again as soon as it is armed."""
    against = (row for row in rows if row.fault.blocks_arming or row.response >= Response.LAND)
    return "; ".join(f"{row.fault.id} ({row.detail})" for row in against)


CHECKS: tuple[Check, ...] = (
    Check("heartbeats", "fusion, fault detector, controller and valve node publish", _heartbeats),
    Check("faults", "no fault stands that keeps it on the ground, or would land it", _faults),
    Check("lesser faults", "nor one that a person may override", _lesser_faults, may_be_overridden=True),
    Check("rest", "unbroken rest with good IMU data, as long as the rig asks for", _rest,
          may_be_overridden=True),
    Check("fixes", "agreeing fixes from pictures that are not repeated", _fixes),
    Check("pose", "it stands on its part of the table", _pose),
    Check("apart", "no other mock-up is too near", _apart),
)  # fmt: skip
"""THE TABLE. Faults cover recorder and disk, gas, battery, serial number and plausibility of the IMU."""


def objections(question: Question, override: str = "") -> tuple[str, ...]:
    """What keeps a vehicle on the ground, each with the name of its check.

    Args:
        question: What the checks look at.
        override: A person's reason to fly in spite of what may be overridden; empty for none.
    """
    found = ((check, check.objection(question)) for check in CHECKS)
    return tuple(
        f"{check.name}: {text}"
        for check, text in found
        if text and not (override and check.may_be_overridden)
    )
