"""The newest of each vehicle and of the rig, as JSON: what the screens draw, and ``GET /api/state``."""

from collections.abc import Iterable
from typing import Any

from groundstation.console.feed import Feed
from groundstation.declarations.lease import Lease
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.parts.operation.messages import RecorderStatus
from groundstation.parts.overhead.messages import OverheadFix
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.scenario.messages import ScenarioStatus
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import Outlook, ValveDemand, ValveStatus

STALE_S = 0.5
"""A state that is older is shown grey, with its age."""


def vehicle_state(feed: Feed, name: str, now_ns: int) -> dict[str, Any]:
    """What is known of a vehicle; SI and radians, times as ages. Keys are left out where nothing came yet."""
    found: dict[str, Any] = {"age_s": None, "words": "nothing received yet"}
    state = feed.get(VehicleState, name)
    if state is not None:
        found |= {
            "age_s": (now_ns - state.stamp_ns) * 1e-9,
            "x_m": state.position_table_m[0],
            "y_m": state.position_table_m[1],
            "heading_rad": state.heading_rad,
            "velocity_table_m_s": state.velocity_table_m_s,
            "rate_rad_s": state.rate_rad_s,
            "pose_sigma": state.pose_sigma,
            "status": state.status,
            "stamp_ns": state.stamp_ns,
        }
    ruling = feed.get(Supervision, name)
    if ruling is not None:
        found |= {
            "mode": ruling.mode,
            "law": ruling.law,
            "cause": ruling.cause,
            "author": ruling.author,
            "mode_age_s": (now_ns - ruling.since_ns) * 1e-9,
            "stop_latched": ruling.stop_latched,
            "flight_wanted": ruling.flight_wanted,
            "waits_for": ruling.waits_for,
            "latched": ruling.latched,
            "words": _words(ruling),
        }
    status = feed.get(ControlStatus, name)
    if status is not None:
        found["control"] = {
            "controller": status.controller,
            "goal_x_m": status.goal_position_table_m[0],
            "goal_y_m": status.goal_position_table_m[1],
            "goal_heading_rad": status.goal_heading_rad,
            "error_m": status.error_position_m,
            "error_rad": status.error_heading_rad,
        }
    valves = feed.get(ValveStatus, name)
    if valves is not None:
        found["valves"] = {
            "open_mask": valves.open_mask,
            "armed": valves.armed,
            "floating": valves.floating,
            "pressure_pa": valves.pressure_pa,
            "faults": valves.faults,
            "dead_man": valves.dead_man,
        }
    return found | _further(feed, name, now_ns)


def _further(feed: Feed, name: str, now_ns: int) -> dict[str, Any]:
    found: dict[str, Any] = {}
    outlook = feed.get(Outlook, name)
    if outlook is not None:
        found["outlook"] = {
            "time_to_edge_s": outlook.time_to_edge_s,
            "stopping_distance_m": outlook.stopping_distance_m,
            "edge_room_m": outlook.edge_room_m,
            "nearest": outlook.nearest,
            "nearest_room_m": outlook.nearest_room_m,
            "limited_by": outlook.limited_by,
            "age_s": (now_ns - outlook.stamp_ns) * 1e-9,
        }
    demand = feed.get(ValveDemand, name)
    if demand is not None:
        found["demand"] = {"source": demand.source, "limited_by": demand.limited_by}
    fusion = feed.get(FusionStatus, name)
    if fusion is not None:
        found["fusion"] = {
            "method": fusion.method,
            "fixes_used": fusion.fixes_used,
            "fixes_refused": fusion.fixes_refused,
            "fix_age_s": fusion.fix_age_s,
            "rest_s": fusion.rest_s,
        }
    reference = feed.get(ReferenceState, name)
    if reference is not None:
        found["reference"] = [*reference.position_table_m, reference.heading_rad]
    overhead = feed.get(OverheadFix, name)
    if overhead is not None and overhead.fix:
        age_s = (now_ns - overhead.stamp_ns) * 1e-9
        found["overhead"] = [overhead.x_m, overhead.y_m, overhead.heading_rad, age_s]
    faults = feed.get(Faults, name)
    if faults is not None:
        rows = (
            faults.ids, faults.whats, faults.details, faults.since_ns, faults.responses, faults.advices,
            faults.gone_ns,
        )  # fmt: skip
        found["faults"] = [
            {
                "id": id_,
                "what": what,
                "detail": detail,
                "age_s": (now_ns - since_ns) * 1e-9,
                "response": response,
                "advice": advice,
                "is_gone": bool(gone_ns),
            }
            for id_, what, detail, since_ns, response, advice, gone_ns in zip(*rows, strict=True)
        ]
    return found


def rig_state(feed: Feed, vehicles: Iterable[str], now_ns: int) -> dict[str, Any]:
    """What is known of all vehicles, of lease, recorder and scenario."""
    found: dict[str, Any] = {
        "now_ns": now_ns,
        "vehicles": {name: vehicle_state(feed, name, now_ns) for name in vehicles},
    }
    lease = feed.get(Lease, "")
    if lease is not None and lease.holder:
        left_s = (lease.expires_ns - now_ns) * 1e-9
        found["lease"] = {"holder": lease.holder, "left_s": max(left_s, 0.0)}
    recorder = feed.get(RecorderStatus, "")
    if recorder is not None:
        found["recorder"] = {
            "path": recorder.path,
            "written_bytes": recorder.written_bytes,
            "room_s": recorder.room_s,
            "age_s": (now_ns - recorder.stamp_ns) * 1e-9,
        }
    scenario = feed.get(ScenarioStatus, "")
    if scenario is not None:
        found["scenario"] = {
            "name": scenario.name,
            "state": scenario.state,
            "t_s": (now_ns - scenario.zero_ns) * 1e-9 if scenario.zero_ns else None,
            "fired": scenario.fired,
            "waits_for": scenario.waits_for,
            "reason": scenario.reason,
        }
    return found


def _words(ruling: Supervision) -> str:
    """The state of a vehicle for people."""
    words = ruling.mode
    if ruling.stop_latched:
        words += ", stop is latched"
    if ruling.cause:
        words += f": {ruling.cause}"
    if ruling.flight_wanted and ruling.waits_for and not ruling.is_in_flight:
        words += f"; waits for {', '.join(ruling.waits_for)}"
    return words
