"""From a recording (.mcap) or a data folder to flights: the one way in for every calibration."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.declarations.errors import UsageError
from groundstation.declarations.rig import Rig
from groundstation.fusion.estimator import Estimator
from groundstation.fusion.flight_data import FlightData
from groundstation.parts.fusion.estimation import rig_noise
from groundstation.parts.fusion.part import fusion_node
from groundstation.parts.imu.messages import Imu
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.stars.sections import StarsOfType, StarsOfVehicle
from groundstation.parts.valves.messages import ValveStatus
from groundstation.recording.reader import Recording
from groundstation.rig.provenance import recorded_rig
from groundstation.rig.read import load_rig
from groundstation.runners.replay import ReplayRunner

READ = (Imu, StarFix, ValveStatus, ReferenceState)
USABLE_RATE = 1
NEVER_S = 1e9


def read_flight(
    source: Path,
    vehicle: str | None = None,
    rig_path: Path | None = None,
    *,
    with_stars: bool = True,
    rates_only: bool = False,
) -> FlightData:
    """Read packets with finite, rising stamps, and fixes by arrival.

    Of a recording, seconds count from the start of its first sample, and the rest at the start lasts until
    the vehicle floats. Each fix has its own covariance and the rig's floor; the sigmas of the noise are
    their medians.

    Args:
        source: An .mcap file, or a folder with imu.csv, meta.json and, where fixes are wanted, stars.csv.
        vehicle: Of the recording; its only one if None.
        rig_path: Rig instead of the recorded one.
        with_stars: Whether fixes are wanted.
        rates_only: Whether samples count whose turn rate alone is usable, of vehicles with a star camera.

    Raises:
        RecordingError: The recording cannot be read.
        UsageError: Something of it or of its rig is missing or wrong.
        FileError: Something of the folder is.
    """
    if source.is_dir():
        return read_folder(source, with_stars=with_stars).tidied()
    with opened(source, rig_path) as (recording, rig):
        names = [
            name for name in rig.vehicles if not rates_only or rig.vehicle(name, StarsOfVehicle).star_camera
        ]
        chosen = _one_of(source, names, vehicle, "star cameras fly on" if rates_only else "there are")
        return _of_recording(source, recording, rig, chosen, rates_only=rates_only).tidied()


@contextmanager
def opened(source: Path, rig_path: Path | None = None) -> Iterator[tuple[Recording, Rig]]:
    """Open a recording together with the rig that it was made with, or with another one.

    Raises:
        RecordingError: The recording cannot be read.
        UsageError: It holds no rig, or the rig is wrong.
    """
    with Recording(source) as recording:
        if rig_path is not None:
            rig = load_rig(rig_path)
        elif recording.info.rig_toml:
            rig = recorded_rig(recording)
        else:
            raise UsageError(f"{source} holds no rig: name one with --rig.")
        yield recording, rig


def fuse(recording: Recording, rig: Rig, vehicle: str, estimator: Estimator) -> None:
    """Replay the fusion node of a vehicle with another estimator: it is given what it was given then.

    Raises:
        UsageError: The recording holds no fusion of this vehicle, or not what it received.
    """
    key = f"{vehicle}/fusion"
    ReplayRunner(recording, lambda _key: fusion_node(rig, vehicle, estimator), [key]).run()


def _one_of(source: Path, names: list[str], vehicle: str | None, what: str) -> str:
    known = f"{what} {', '.join(names) or 'no vehicle'}"
    if vehicle is None and len(names) != 1:
        raise UsageError(f"{source}: {known}: choose one with --vehicle.")
    if vehicle is not None and vehicle not in names:
        raise UsageError(f"{source} has no vehicle {vehicle!r}: {known}.")
    return vehicle or names[0]


def _of_recording(
    source: Path, recording: Recording, rig: Rig, vehicle: str, *, rates_only: bool
) -> FlightData:
    def is_wanted(sample: Imu) -> bool:
        return bool(sample.usable & USABLE_RATE) if rates_only else sample.valid

    imu: list[tuple[float, ...]] = []
    stars: list[tuple[float, ...]] = []
    reference: list[tuple[float, ...]] = []
    covariance: list[tuple[float, ...]] = []
    origin_ns, floats_s = 0, NEVER_S
    for message in recording.messages(READ, (vehicle,)):
        payload, logged_s = message.payload, (message.log_ns - origin_ns) * 1e-9
        stamp_s = (payload.stamp_ns - origin_ns) * 1e-9
        match payload:
            case Imu() if is_wanted(payload):
                if not imu:
                    origin_ns = payload.stamp_ns - round(payload.window_s * 1e9)
                    stamp_s = (payload.stamp_ns - origin_ns) * 1e-9
                imu.append(
                    (stamp_s, payload.rate_body_rad_s, *payload.force_body_m_s2, payload.temperature_c)
                )
            case StarFix(fix=True) if imu:
                stars.append((stamp_s, logged_s, payload.x_m, payload.y_m, payload.heading_rad))
                covariance.append(payload.covariance)
            case ReferenceState() if imu:
                reference.append((stamp_s, *payload.position_table_m, payload.heading_rad))
            case ValveStatus(floating=True) if imu:
                floats_s = min(floats_s, logged_s)
    if not imu:
        raise UsageError(f"{source} holds no valid sample of {vehicle}.")
    noise, camera = rig_noise(rig, vehicle), rig.of_type(vehicle, StarsOfType).star_camera
    floor_m, floor_rad = rig.tables.fix_sources["stars"].floor(rig, vehicle)
    own = np.array(covariance).reshape(-1, 3, 3) + np.diag([floor_m**2, floor_m**2, floor_rad**2])
    if len(own):
        xy, heading = 0.5 * (own[:, 0, 0] + own[:, 1, 1]), own[:, 2, 2]
        noise = replace(
            noise,
            star_sigma_xy_m=math.sqrt(float(np.median(xy))),
            star_sigma_heading_rad=math.sqrt(float(np.median(heading))),
        )
    return FlightData(
        np.array(imu),
        np.array(stars).reshape(-1, 5),
        own,
        min(floats_s, imu[-1][0]),
        noise,
        np.array(reference).reshape(-1, 4),
        0.0 if camera is None else camera.delay[0],
    )
