"""A recorded flight as arrays: packets, fixes and truth of one vehicle, whatever flew it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from groundstation.declarations.errors import UsageError
from groundstation.declarations.rig import Rig
from groundstation.fusion.flight_data import REFERENCE_COLUMNS, FlightData
from groundstation.parts.fusion.estimation import rig_noise
from groundstation.parts.imu.messages import Imu
from groundstation.parts.imu.sections import ImuOfType
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.stars.sections import StarsOfType
from groundstation.parts.valves.messages import ValveStatus
from groundstation.recording.reader import Recording
from groundstation.rig.provenance import recorded_rig
from groundstation.rig.read import load_rig

READ = (Imu, StarFix, ValveStatus, ReferenceState)
USABLE_RATE = 1
NEVER_S = 1e9


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


def one_of(source: Path, names: Sequence[str], vehicle: str | None, what: str) -> str:
    """Return the vehicle that is meant: the one named, or the only one.

    Args:
        source: Of the recording.
        names: There are.
        vehicle: Named, or None.
        what: Before the names in a refusal.

    Raises:
        UsageError: There is none, or several and none is named.
    """
    known = f"{what} {', '.join(names) or 'no vehicle'}"
    if vehicle is None and len(names) != 1:
        raise UsageError(f"{source}: {known}: choose one with --vehicle.")
    if vehicle is not None and vehicle not in names:
        raise UsageError(f"{source} has no vehicle {vehicle!r}: {known}.")
    return vehicle or names[0]


def recorded_flight(
    source: Path, recording: Recording, rig: Rig, vehicle: str, *, rates_only: bool = False
) -> FlightData:
    """Read a vehicle's flight.

    Seconds count from the start of its first sample, and the rest at the start lasts until it floats. Each
    fix has its own covariance and the rig's floor; the sigmas of the noise are their medians.

    Args:
        source: The recording's file.
        recording: The same, open.
        rig: Of the recording, or another one.
        vehicle: Its name.
        rates_only: Whether samples count whose turn rate alone is usable.

    Raises:
        RecordingError: The recording cannot be read.
        UsageError: It holds no sample of the vehicle.
    """

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
                motion = (*payload.velocity_table_m_s, payload.rate_rad_s)
                reference.append((stamp_s, *payload.position_table_m, payload.heading_rad, *motion))
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
        np.array(reference).reshape(-1, REFERENCE_COLUMNS),
        0.0 if camera is None else camera.delay[0],
    )


def known_of_rig(rig: Rig, vehicle: str) -> dict[str, float]:
    """Return what a data set knows beside the flight: mass, inertia, and the sensors' low-pass filters."""
    type_, imu = rig.type_of(vehicle), rig.of_type(vehicle, ImuOfType).imu
    return {
        "mass_kg": type_.mass_kg,
        "inertia_kg_m2": type_.inertia_kg_m2,
        "gyro_bandwidth_hz": imu.gyro_bandwidth_hz,
        "acc_bandwidth_hz": imu.acc_bandwidth_hz,
    }
