"""Recordings and data folders turned into the flight logs that a table map is learned from."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from calibration.flights import fuse, opened
from calibration.outcome import CalibrationRefusedError
from calibration.table.flight_log import FlightLog
from groundstation.data_sets.fusion_folder import read_folder
from groundstation.declarations.errors import UsageError
from groundstation.fusion.estimator import Fix, FixOutcome, ImuPacket, PlanarState
from groundstation.fusion.flight_data import estimate
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.offline import OfflineSmoother
from groundstation.parts.fusion.estimation import rig_noise

Array = NDArray[np.float64]
Bounds = tuple[float, float, float, float]

REFERENCE_C = 25.0
CLOCK_SMOOTHING_S = 10.0
"""Ticks are laid on the stamps by a mean over this time: quartz drifts slowly, stamps jitter."""
WILD_SIGMAS = 8.0


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """What one recording or folder gives."""

    path: Path
    logs: tuple[FlightLog, ...]
    bounds_m: Bounds | None
    """Of the table, where the rig states."""
    legs_m: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Where the legs stand, likewise."""


class Tap(OfflineSmoother):
    """The smoother, with a copy of everything it was fed."""

    def __init__(self, noise: NoiseModel) -> None:
        super().__init__(noise)
        self.packets: list[ImuPacket] = []
        self.fixes: list[Fix] = []
        self.accounts: dict[int, FixOutcome] = {}
        self.rests_ns: list[tuple[int, int | None]] = []

    def begin_rest(self, t_ns: int) -> None:
        super().begin_rest(t_ns)
        if not self.rests_ns or self.rests_ns[-1][1] is not None:
            self.rests_ns.append((t_ns, None))

    def end_rest(self, t_ns: int) -> None:
        super().end_rest(t_ns)
        if self.rests_ns and self.rests_ns[-1][1] is None:
            self.rests_ns[-1] = (self.rests_ns[-1][0], t_ns)

    def add_imu(self, packet: ImuPacket) -> PlanarState | None:
        self.packets.append(packet)
        return super().add_imu(packet)

    def add_fix(self, fix: Fix) -> FixOutcome:
        account = super().add_fix(fix)
        self.fixes.append(fix)
        self.accounts[account.t_exposure_ns] = account
        return account

    def settled(self) -> list[FixOutcome]:
        late = super().settled()
        self.accounts.update((account.t_exposure_ns, account) for account in late)
        return late


def read_source(path: Path, rig_path: Path | None, vehicle: str | None) -> Source:
    """Read and smooth a recording (.mcap) or a folder with imu.csv, stars.csv and meta.json.

    Raises:
        RecordingError: The recording cannot be read.
        UsageError: Something of it or of its rig is missing or wrong.
        FileError: Something of the folder is.
        CalibrationRefusedError: No vehicle flew.
    """
    if path.is_dir():
        data = read_folder(path)
        tap = Tap(data.noise)
        estimate(data, tap)
        tap.settled()
        return Source(path, (flight_log(path.name, tap),), None)
    with opened(path, rig_path) as (recording, rig):
        if vehicle is not None and vehicle not in rig.vehicles:
            raise UsageError(f"{path} has no vehicle {vehicle!r}; there are {', '.join(rig.vehicles)}.")
        logs = []
        for name in rig.vehicles if vehicle is None else (vehicle,):
            tap = Tap(rig_noise(rig, name))
            fuse(recording, rig, name, tap)
            logs.append(flight_log(f"{path.name}:{name}", tap))
    table = rig.table
    edges = (table.x_min_m, table.x_max_m, table.y_min_m, table.y_max_m)
    return Source(path, tuple(logs), edges, table.legs)


def flight_log(name: str, tap: Tap) -> FlightLog:
    """Lay packets, smoothed states and used fixes out as arrays."""
    states = tap.states()
    known = [i for i, state in enumerate(states) if state is not None]
    if len(known) < 2:
        raise CalibrationRefusedError(f"{name} never had a pose: no two of its {len(tap.fixes)} fixes agree")
    first, last = known[0], known[-1]
    origin_ns = tap.packets[first].t_ns - 1_000_000_000
    noise = tap.noise
    rows = list(_rows(tap.packets[first : last + 1], states[first : last + 1], noise.packet_period_s))
    span = np.array([row[0] for row in rows])
    readings = np.array([row[1:4] for row in rows])
    stamps = np.array([row[4] - origin_ns for row in rows]) * 1e-9
    ticks = np.cumsum(span)
    size = max(1, round(CLOCK_SMOOTHING_S / noise.packet_period_s))
    drift = stamps - ticks
    whole = ~np.isnan(stamps)
    drift = np.interp(np.arange(len(drift)), np.flatnonzero(whole), drift[whole])
    end = ticks + uniform_filter1d(drift, size, mode="nearest")
    span = np.diff(end, prepend=end[0] - span[0])
    rests = tuple(
        ((a - origin_ns) * 1e-9, float(end[-1]) if b is None else (b - origin_ns) * 1e-9)
        for a, b in tap.rests_ns
    )
    good = ~np.isnan(readings[:, 0])
    good[good] = ~_wild(end[good], readings[good, :2], rests, noise)
    for k in range(3):
        readings[~good, k] = np.interp(end[~good], end[good], readings[good, k])

    chosen = [state for state in states if state is not None]
    t = np.array([state.t_ns - origin_ns for state in chosen]) * 1e-9
    smoothed = np.array([state[1:6] for state in chosen])  # x, y, heading, vx, vy
    felt = end - 0.5 * span - noise.acc_lag_s
    fixes = sorted(
        (f for f in tap.fixes if tap.accounts[f.t_exposure_ns].used), key=lambda f: f.t_exposure_ns
    )
    fixes = [f for f in fixes if t[0] <= (f.t_exposure_ns - origin_ns) * 1e-9 <= t[-1]]
    exposure = np.array([f.t_exposure_ns - origin_ns for f in fixes]) * 1e-9
    velocity = np.column_stack([np.interp(exposure, t, smoothed[:, k]) for k in (3, 4)])
    covariance = np.array([f.covariance[:2, :2] for f in fixes]).reshape(-1, 2, 2)
    covariance = covariance + noise.fix_time_sigma_s**2 * velocity[:, :, None] * velocity[:, None, :]
    return FlightLog(
        name=name,
        end_s=end,
        span_s=span,
        force_body_m_s2=readings[:, :2],
        warmth_k=readings[:, 2],
        heading_rad=np.interp(felt, t, smoothed[:, 2]),
        position_table_m=np.column_stack([np.interp(felt, t, smoothed[:, k]) for k in (0, 1)]),
        is_hole=~good,
        fix_s=exposure + noise.acc_lag_s,
        fix_position_m=np.array([(f.x_m, f.y_m) for f in fixes]).reshape(-1, 2),
        fix_covariance_m2=covariance,
        fix_heading_rad=np.interp(exposure, t, smoothed[:, 2]),
        fix_velocity_m_s=velocity,
        rests_s=rests,
        imu_body_m=(noise.imu_offset_x_m, noise.imu_offset_y_m),
        acc_density_m_s2_rthz=noise.acc_density_m_s2_rthz,
    )


def _wild(
    end_s: Array, force: Array, rests_s: tuple[tuple[float, float], ...], noise: NoiseModel
) -> NDArray[np.bool_]:
    """Return which single packets jump away and back by more than the motion can.

    A filter at rest does not integrate and so may have let them pass.
    """
    padded = np.pad(force, ((2, 2), (0, 0)), mode="edge")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5, axis=0), axis=-1)
    white = noise.acc_density_m_s2_rthz / math.sqrt(noise.packet_period_s)
    limit = np.full(len(end_s), noise.max_acc_step_m_s2 + WILD_SIGMAS * white)
    for start_s, stop_s in rests_s:
        limit[(end_s > start_s) & (end_s <= stop_s)] = WILD_SIGMAS * white
    return np.asarray((np.abs(force - middle) > limit[:, None]).any(axis=1))


def _rows(
    packets: list[ImuPacket], states: list[PlanarState | None], period_s: float
) -> Iterator[tuple[float, float, float, float, float]]:
    """Yield span, ax, ay, warmth and stamp (ns) of packets and of the holes between them, which hold NaN."""
    newest_ns = packets[0].t_ns - 1
    for packet, state in zip(packets, states, strict=True):
        if packet.t_ns <= newest_ns:
            continue  # a stamp that is not new: the filter has refused it too
        newest_ns = packet.t_ns
        missing = packet.dt_s - period_s
        if missing > 0.5 * period_s:
            yield missing, math.nan, math.nan, math.nan, math.nan
        span = min(packet.dt_s, period_s) if missing > 0.5 * period_s else packet.dt_s
        if state is None:
            yield span, math.nan, math.nan, math.nan, float(packet.t_ns)
        else:
            warmth = packet.temperature_c - REFERENCE_C
            warmth = 0.0 if math.isnan(warmth) else warmth
            yield span, packet.ax_m_s2, packet.ay_m_s2, warmth, float(packet.t_ns)
