"""A recording (.mcap) or a data folder as packets, fixes and noise: what the calibrations read."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.topics import topic_of
from groundstation.cli.errors import UsageError
from groundstation.cli.fusion_folder import (
    IMU_COLUMNS,
    STAR_COLUMNS,
    FusionFolder,
    noise_of,
    read_known,
    read_table,
)
from groundstation.messages import definitions as m
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.runtime.errors import RigError
from groundstation.runtime.estimation import fix_floor_of, rig_noise
from groundstation.runtime.rig import Rig, load_rig, parse_rig

Array = NDArray[np.float64]

HEARD = tuple(topic_of(kind) for kind in (m.Imu, m.StarFix, m.ValveStatus))
NEVER_S = 1e9


def read_flight(
    source: Path, vehicle: str | None = None, rig_path: Path | None = None, *, with_stars: bool = True
) -> FusionFolder:
    """Read packets with finite, rising stamps, and fixes by arrival.

    Of a recording, seconds count from the start of its first sample; the rest at the start lasts until the
    vehicle floats, and the sigma of the fixes is the median of what they said.

    Args:
        source: an .mcap file, or a folder with imu.csv, meta.json and, where fixes are wanted, stars.csv.
        vehicle: of the recording; its only one if None.
        rig_path: rig instead of the recorded one.
        with_stars: whether fixes are wanted.

    Raises:
        UsageError: something is missing or wrong.
    """
    if source.is_dir():
        known = read_known(source / "meta.json")
        imu = read_table(source / "imu.csv", IMU_COLUMNS)
        stars = np.empty((0, len(STAR_COLUMNS)))
        if with_stars:
            stars = read_table(source / "stars.csv", STAR_COLUMNS)
        return _tidied(FusionFolder(imu, stars, known["run_start_s"], noise_of(known)))
    try:
        with Recording(source) as recording:
            rig = _rig_of(source, recording, rig_path)
            return _tidied(_of_recording(source, recording, rig, _vehicle_of(source, rig, vehicle)))
    except (RecordingError, RigError) as error:
        raise UsageError(f"{error}.") from error


def _rig_of(source: Path, recording: Recording, rig_path: Path | None) -> Rig:
    if rig_path is not None:
        return load_rig(rig_path)
    if not recording.info.rig_toml:
        raise UsageError(f"{source} says nothing of its rig: name one with --rig.")
    return parse_rig(recording.info.rig_toml, Path(recording.info.rig_path or source))


def _vehicle_of(source: Path, rig: Rig, vehicle: str | None) -> str:
    names = ", ".join(rig.vehicles)
    if vehicle is None and len(rig.vehicles) > 1:
        raise UsageError(f"{source} has several vehicles ({names}): choose one with --vehicle.")
    if vehicle is not None and vehicle not in rig.vehicles:
        raise UsageError(f"{source} has no vehicle {vehicle!r}; there are {names}.")
    return vehicle or next(iter(rig.vehicles))


def _of_recording(source: Path, recording: Recording, rig: Rig, vehicle: str) -> FusionFolder:
    imu: list[tuple[float, ...]] = []
    stars: list[tuple[float, ...]] = []
    said: list[tuple[float, float]] = []
    origin_ns, floats_s = 0, NEVER_S
    for message in recording.messages(HEARD, (vehicle,)):
        payload = message.payload
        match payload:
            case m.Imu(valid=True):
                if not imu:
                    origin_ns = payload.stamp_ns - round(payload.window_s * 1e9)
                stamp_s = (payload.stamp_ns - origin_ns) * 1e-9
                imu.append(
                    (stamp_s, payload.rate_body_rad_s, *payload.force_body_m_s2, payload.temperature_c)
                )
            case m.StarFix(fix=True) if imu:
                exposure_s = (payload.stamp_ns - origin_ns) * 1e-9
                arrival_s = (message.log_ns - origin_ns) * 1e-9
                stars.append((exposure_s, arrival_s, payload.x_m, payload.y_m, payload.heading_rad))
                cov = np.array(payload.covariance).reshape(3, 3)
                said.append((0.5 * (cov[0, 0] + cov[1, 1]), cov[2, 2]))
            case m.ValveStatus(floating=True) if imu:
                floats_s = min(floats_s, (message.log_ns - origin_ns) * 1e-9)
    if not imu:
        raise UsageError(f"{source} holds no valid sample of {vehicle}.")
    noise = rig_noise(rig, vehicle)
    if said:
        floor = fix_floor_of(rig, vehicle)
        sigma = [math.sqrt(float(v) + f**2) for v, f in zip(np.median(said, axis=0), floor, strict=True)]
        noise = replace(noise, star_sigma_xy_m=sigma[0], star_sigma_heading_rad=sigma[1])
    table = np.array(stars).reshape(-1, len(STAR_COLUMNS))
    return FusionFolder(np.array(imu), table, min(floats_s, imu[-1][0]), noise)


def _tidied(data: FusionFolder) -> FusionFolder:
    imu = data.imu[np.isfinite(data.imu[:, 0])]
    rising = imu[:, 0] > np.maximum.accumulate(np.concatenate([[-np.inf], imu[:-1, 0]]))
    stars = data.stars[np.argsort(data.stars[:, 1], kind="stable")]
    return FusionFolder(imu[rising], stars, data.run_start_s, data.noise)
