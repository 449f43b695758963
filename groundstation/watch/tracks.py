"""What a recording says of each vehicle, as arrays: the stuff of reports and figures."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.topics import topic_of
from groundstation.messages import definitions as m
from groundstation.recording.reader import Recording

Array = NDArray[np.float64]
_KINDS = (
    m.ReferenceState,
    m.VehicleState,
    m.ControlStatus,
    m.ValveCommand,
    m.SequencePhase,
    m.FixAccount,
    m.FixComparison,
    m.Latency,
    m.Imu,
)


@dataclass(slots=True)
class Track:
    """Everything of one vehicle that the report draws; times in s since the recording began.

    Attributes:
        truth: Rows of t, x, y, heading (unwrapped), vx, vy, rate; shape (n, 7).
        state: Rows of t, x, y, heading, and standard deviations of x, y, heading; shape (n, 7).
        goal: Rows of t, x, y, heading; shape (n, 4).
        open_masks: Rows of t, open mask; shape (n, 2).
        flying_since_s: When the start sequence said so; NaN if never.
        fixes: Counts of fixes used and refused, by reason.
        comparisons: Of star fixes with overhead fixes, where there are both.
        accounts: Rows of t, used (1 or 0), innovation x, y (m), heading (rad), NIS; shape (n, 6).
        account_reasons: What was said of each row.
        latency: The newest summary.
        frames_lost: IMU frames missing at the end.
        imu_frames: IMU samples seen.
    """

    truth: Array
    state: Array
    goal: Array
    open_masks: Array
    accounts: Array = field(default_factory=lambda: np.empty((0, 6)))
    account_reasons: list[str] = field(default_factory=list)
    flying_since_s: float = math.nan
    fixes: dict[str, int] = field(default_factory=dict)
    comparisons: list[m.FixComparison] = field(default_factory=list)
    latency: m.Latency | None = None
    frames_lost: int = 0
    imu_frames: int = 0


def read_tracks(source: Recording) -> dict[str, Track]:
    """Collect per vehicle what the report needs."""
    rows: dict[str, dict[str, list[tuple[float, ...]]]] = {}
    tracks: dict[str, Track] = {}
    start_ns = source.start_ns
    for delivered in source.delivered([topic_of(kind) for kind in _KINDS]):
        payload = delivered.payload
        name = payload.vehicle
        if name not in tracks:
            tracks[name] = Track(np.empty((0, 7)), np.empty((0, 7)), np.empty((0, 4)), np.empty((0, 2)))
            rows[name] = {"truth": [], "state": [], "goal": [], "open_masks": [], "accounts": []}
        track, row = tracks[name], rows[name]
        t_s = (payload.stamp_ns - start_ns) * 1e-9
        match payload:
            case m.ReferenceState():
                row["truth"].append(
                    (
                        t_s,
                        *payload.position_table_m,
                        payload.heading_rad,
                        *payload.velocity_table_m_s,
                        payload.rate_rad_s,
                    )
                )
            case m.VehicleState():
                row["state"].append((t_s, *payload.position_table_m, payload.heading_rad, *payload.pose_std))
            case m.ControlStatus():
                row["goal"].append((t_s, *payload.goal_position_table_m, payload.goal_heading_rad))
            case m.ValveCommand():
                row["open_masks"].append((t_s, float(payload.open_mask)))
            case m.SequencePhase(phase="flying"):
                track.flying_since_s = t_s
            case m.FixAccount():
                reason = "used" if payload.used else payload.reason
                track.fixes[reason] = track.fixes.get(reason, 0) + 1
                track.account_reasons.append(payload.reason)
                row["accounts"].append((t_s, float(payload.used), *payload.innovation, payload.nis))
            case m.FixComparison():
                track.comparisons.append(payload)
            case m.Latency():
                track.latency = payload
            case m.Imu():
                track.frames_lost = payload.frames_lost
                track.imu_frames += 1
    for name, track in tracks.items():
        for attribute, found in rows[name].items():
            if found:
                setattr(track, attribute, np.array(found))
        track.truth[:, 3] = np.unwrap(track.truth[:, 3])
    return {name: track for name, track in tracks.items() if len(track.state)}


def station_errors(track: Track) -> Array:
    """Truth against goal while flying: rows of t, position error (m), heading error (rad)."""
    if not len(track.goal) or not len(track.truth) or math.isnan(track.flying_since_s):
        return np.empty((0, 3))
    truth = track.truth[track.truth[:, 0] >= track.flying_since_s]
    newest = np.searchsorted(track.goal[:, 0], truth[:, 0], side="right").clip(1, len(track.goal)) - 1
    goal = track.goal[newest]
    distance = np.hypot(truth[:, 1] - goal[:, 1], truth[:, 2] - goal[:, 2])
    turn = (truth[:, 3] - goal[:, 3] + math.pi) % math.tau - math.pi
    return np.column_stack([truth[:, 0], distance, turn])


def estimate_errors(track: Track) -> Array:
    """Estimate against truth at the estimate's stamps: rows of t, dx, dy (m), heading (rad)."""
    if len(track.truth) < 2:
        return np.empty((0, 4))
    t = track.state[:, 0]
    inside = (t >= track.truth[0, 0]) & (t <= track.truth[-1, 0])
    state = track.state[inside]
    columns = [np.interp(state[:, 0], track.truth[:, 0], track.truth[:, i]) for i in (1, 2, 3)]
    turn = (state[:, 3] - columns[2] + math.pi) % math.tau - math.pi
    return np.column_stack([state[:, 0], state[:, 1] - columns[0], state[:, 2] - columns[1], turn])
