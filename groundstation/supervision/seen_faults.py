"""What is wrong with a vehicle by what is known of it and its neighbours at a moment. Pure."""

import math
from collections.abc import Iterator

from groundstation.control.corridor import may_touch
from groundstation.control.edge import EdgeVerdict, edge_outlook
from groundstation.control.state import ControlState
from groundstation.supervision.clearance import clearance
from groundstation.supervision.sightings import NS_PER_S, OTHER_S, Sightings

FINDINGS_S, RECORDER_S = 1.0, 2.0
"""After so long without news, fault detector or recorder are silent."""
FORGETTING_S = 0.5
"""Memory that cannot be written is tried ten times a second."""
FRESH_S = 0.1
"""An older status says nothing about an order that was just given."""
STARTING_S = 10.0
"""So long processes may take to start before their silence on the ground is a fault."""
LATE_TICK_S = 0.1
STOOD_STILL_S = 1.0
LARGEST_SIGMA_M, LARGEST_SIGMA_RAD = 0.05, math.radians(5.0)
LEAST_BRAKING_M_S2 = 0.005
"""With less no push could be braked on a table; a sixth of what healthy valves give."""
LEAST_TANK_PA = 30e5
LEAST_ROOM_S = 60.0
OVERHANG_M = 0.05
"""So far beyond its part of the table a predicted stop may lie before the air is cut: noise."""
REACTION_S = 0.15
"""Age of the state, a modulation period, the opening of a valve."""
SINKING_S, LANDED_M_S2 = 0.5, 1.0
"""Until the bearings carry no more, and what the table brakes with then; the worst that is expected."""
SLIDING_ROOM_M = 0.01
"""Left after landing, below which the air of a disarmed mock-up is cut."""
ONLY_ALOFT = frozenset(
    {
        "star_outage",
        "fixes_rare",
        "wrong_fixes",
        "pushed",
        "valve_stuck_open",
        "valve_stuck_closed",
        "valve_weak",
    }
)
"""What is found by how it moves means nothing on the ground, where people lift it and friction holds it."""
UNDERVOLTAGE, COIL_FAULT = 1, 0x80
"""Fault bits of the valve node: the lowest, and the one by which the station says that a coil is reported."""


def faults_seen(
    seen: Sightings, now_ns: int, *, is_grounded: bool, is_aloft: bool, may_open: bool
) -> dict[str, str]:
    """Faults seen at this moment, by id with details.

    Args:
        seen: What is known.
        now_ns: The moment.
        is_grounded: The air is off and known to be: who has just begun may still be silent.
        is_aloft: The float air is on, or about to be: what concerns motion is looked at, too.
        may_open: The guard is armed and the valve node should be.
    """
    found = {fault: detail for fault, detail in seen.findings.items() if is_aloft or fault not in ONLY_ALOFT}
    if not is_grounded or now_ns - seen.began_ns > STARTING_S * NS_PER_S:
        found.update(_silences(seen, now_ns, is_grounded=is_grounded))
    found.update(_station(seen, now_ns))
    found.update(_supplies(seen))
    if seen.is_controller_silent(now_ns):
        found["controller_silent"] = _age("demand", seen.demand_ns, now_ns)
    if is_aloft:
        found.update(_thrust(seen))
        found.update(_motion(seen, now_ns) if may_open else _sliding(seen, now_ns))
        found.update(_estimate(seen))
        found.update(_obedience(seen, now_ns, may_open=may_open))
    return found


def _silences(seen: Sightings, now_ns: int, *, is_grounded: bool) -> Iterator[tuple[str, str]]:
    if seen.is_state_silent(now_ns) and (seen.own is not None or not is_grounded):
        yield "state_silent", _age("state", None if seen.own is None else seen.own.arrival_ns, now_ns)
    if seen.is_node_silent(now_ns):
        yield "can_silent", _age("status", None if seen.node is None else seen.node.arrival_ns, now_ns)
    if seen.is_silent(seen.findings_ns, FINDINGS_S, now_ns):
        yield "detector_silent", _age("findings", seen.findings_ns, now_ns)
    if seen.recorder_ns is not None and seen.is_silent(seen.recorder_ns, RECORDER_S, now_ns):
        yield "recorder_down", _age("status", seen.recorder_ns, now_ns)
    elif seen.recorder_room_s < LEAST_ROOM_S:
        room_s = seen.recorder_room_s
        yield "disk_low", f"room for {room_s:.0f} s" if room_s else "it is full: nothing is recorded"
    for name in seen.neighbours:
        if name == seen.seen_leader:
            yield from _unseen_leader(seen, now_ns)
            continue
        other = seen.others.get(name)
        if other is not None and seen.is_silent(other.arrival_ns, OTHER_S, now_ns):
            yield "leader_old", f"{name}: {_age('state', other.arrival_ns, now_ns)}"


def _unseen_leader(seen: Sightings, now_ns: int) -> Iterator[tuple[str, str]]:
    """A side camera's sightings count from when the vehicle knows its own place: before, none can be used."""
    if seen.placed_ns is None:
        return
    newest_ns = max(seen.placed_ns, seen.leader_seen_ns or 0)
    if seen.is_silent(newest_ns, OTHER_S, now_ns):
        yield "leader_old", f"{seen.seen_leader} is not seen: {_age('sighting', newest_ns, now_ns)}"


def _station(seen: Sightings, now_ns: int) -> Iterator[tuple[str, str]]:
    is_full, is_silent = seen.recorder_room_s == 0.0, seen.is_silent(seen.recorder_ns, RECORDER_S, now_ns)
    if seen.recorder_trouble and not is_full and not is_silent:  # that has a row of its own
        yield "recording_lost", seen.recorder_trouble
    if seen.memory_trouble and now_ns - seen.memory_ns < FORGETTING_S * NS_PER_S:
        yield "memory_lost", seen.memory_trouble
    if seen.late_s < -0.5 or seen.late_s > STOOD_STILL_S:
        yield "clock_jumped", f"by {seen.late_s:+.2f} s"
    elif seen.late_s > LATE_TICK_S:
        yield "cpu_starved", f"looked {1e3 * seen.late_s:.0f} ms late"


def _supplies(seen: Sightings) -> Iterator[tuple[str, str]]:
    node = seen.node
    if node is None:
        return
    if node.pressure_pa < LEAST_TANK_PA:  # NaN: it has no sensor
        yield "tank_low", f"{node.pressure_pa * 1e-5:.0f} bar"
    if node.bus_rate_hz > seen.most_frames_hz:
        yield "can_flooded", f"{node.bus_rate_hz:.0f} frames a second"
    if node.faults & UNDERVOLTAGE:
        yield "battery_low", "the valve node reports undervoltage"
    if node.faults & COIL_FAULT:
        yield "coil_fault", "the valve node reports an open or shorted coil"


def _thrust(seen: Sightings) -> Iterator[tuple[str, str]]:
    if seen.missing_thrust:
        yield "thrust_missing", seen.missing_thrust
    elif seen.braking_m_s2 < LEAST_BRAKING_M_S2:
        yield "thrust_missing", f"{1e3 * seen.braking_m_s2:.1f} mm/s^2 to brake with"


def _motion(seen: Sightings, now_ns: int) -> Iterator[tuple[str, str]]:
    own = seen.own
    if own is None or own.status != "flying" or seen.is_state_silent(now_ns):
        return
    outlook = edge_outlook(own.state, seen.keep_in, seen.braking_m_s2, reaction_s=REACTION_S)
    if outlook.room_m < -OVERHANG_M:
        beyond = f"it would stop {-1e3 * outlook.room_m:.0f} mm beyond"
        can_brake = seen.braking_m_s2 >= LEAST_BRAKING_M_S2
        yield "edge_unavoidable", beyond if can_brake else "there is nothing left to brake with"
    elif outlook.verdict is not EdgeVerdict.CLEAR:
        yield "edge_ahead", f"it would stop {1e3 * outlook.room_m:.0f} mm before it"
    if not seen.others:
        return
    first = clearance(
        own.state,
        _to_keep_from(seen, own.state, now_ns),
        seen.braking_m_s2,
        reaction_s=REACTION_S,
        radius_m=seen.radius_m,
    )
    if first.verdict is EdgeVerdict.TOO_LATE:
        yield "vehicle_unavoidable", f"{first.name}: they would overlap by {-1e3 * first.room_m:.0f} mm"
    elif first.verdict is EdgeVerdict.BRAKE:
        yield "vehicle_ahead", f"{first.name}: {1e3 * first.room_m:.0f} mm would be left"


def _sliding(seen: Sightings, now_ns: int) -> Iterator[tuple[str, str]]:
    """Disarmed it has no brake but the table itself: the air is cut while there is room to come to rest."""
    own = seen.own
    if own is None or own.status != "flying" or seen.is_state_silent(now_ns):
        return
    outlook = edge_outlook(own.state, seen.keep_in, LANDED_M_S2, reaction_s=SINKING_S)
    if outlook.room_m < SLIDING_ROOM_M:
        yield "edge_unavoidable", f"disarmed it does not brake: landed now, {_left(outlook.room_m)}"
    first = clearance(
        own.state,
        _to_keep_from(seen, own.state, now_ns),
        LANDED_M_S2,
        reaction_s=SINKING_S,
        radius_m=seen.radius_m,
    )
    if first.room_m < SLIDING_ROOM_M:
        detail = f"disarmed it does not brake: landed now, {_left(first.room_m)}"
        yield "vehicle_unavoidable", f"{first.name}: {detail}"


def _left(room_m: float) -> str:
    return f"{1e3 * room_m:.0f} mm would be left" if room_m >= 0.0 else "it would not stop in time"


def _to_keep_from(seen: Sightings, own: ControlState, now_ns: int) -> dict[str, ControlState]:
    """The other vehicles, but for who docks here and is inside its corridor."""
    others = seen.others_here(now_ns)
    exempt = may_touch(seen.name, seen.dockings, {**others, seen.name: own})
    return {name: state for name, state in others.items() if name not in exempt}


def _estimate(seen: Sightings) -> Iterator[tuple[str, str]]:
    own = seen.own
    if own is None:
        return
    if own.status == "lost":
        yield "fusion_lost", "the estimator reports it"
    elif max(own.sigma[:2]) > LARGEST_SIGMA_M or own.sigma[2] > LARGEST_SIGMA_RAD:
        x_m, y_m, heading_rad = own.sigma
        yield (
            "position_uncertain",
            f"sigma {1e3 * x_m:.0f} mm, {1e3 * y_m:.0f} mm, {math.degrees(heading_rad):.1f} deg",
        )


def _obedience(seen: Sightings, now_ns: int, *, may_open: bool) -> Iterator[tuple[str, str]]:
    node = seen.node
    if node is not None and may_open and not seen.is_silent(node.arrival_ns, FRESH_S, now_ns):
        if node.floating and not node.armed:
            yield "node_disobeys", "it reports that it is disarmed"
        elif node.dead_man:
            yield "node_disobeys", "its dead man has closed the valves"
    if may_open and seen.outside_trouble:
        yield "outside_silent", seen.outside_trouble


def _age(what: str, arrival_ns: int | None, now_ns: int) -> str:
    if arrival_ns is None:
        return f"no {what} was ever received"
    return f"the newest {what} is {(now_ns - arrival_ns) / NS_PER_S:.1f} s old"
