"""From a recording (.mcap) or a data folder to flights: the one way in for every calibration."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from groundstation.bus.topics import topic_of
from groundstation.cli.errors import UsageError
from groundstation.data_sets.fusion_folder import read_folder
from groundstation.fusion.estimator import Estimator
from groundstation.fusion.flight_data import FlightData
from groundstation.messages import definitions as m
from groundstation.nodes.fusion import Fusion
from groundstation.recording.reader import Recording
from groundstation.runtime.estimation import fix_floor_of, fused_floors_of, rig_noise
from groundstation.runtime.rig import Rig, load_rig, parse_rig

READ = tuple(topic_of(kind) for kind in (m.Imu, m.StarFix, m.ValveStatus, m.ReferenceState))
FUSED = tuple(topic_of(kind) for kind in (m.Imu, m.StarFix, m.OverheadFix, m.ValveStatus, m.Request))
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
        names = [name for name, section in rig.vehicles.items() if not rates_only or section.star_camera]
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
            rig = parse_rig(recording.info.rig_toml, Path(recording.info.rig_path or source))
        else:
            raise UsageError(f"{source} holds no rig: name one with --rig.")
        yield recording, rig


def fuse(recording: Recording, rig: Rig, vehicle: str, estimator: Estimator) -> None:
    """Feed an estimator through a fusion node with what a recording holds, in the order of its log."""
    node = Fusion(vehicle, estimator, "filter", fused_floors_of(rig, vehicle))
    for message in recording.messages(FUSED, (vehicle,)):
        for _ in node.receive(message.payload, message.log_ns):
            pass


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
    def is_wanted(sample: m.Imu) -> bool:
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
            case m.Imu() if is_wanted(payload):
                if not imu:
                    origin_ns = payload.stamp_ns - round(payload.window_s * 1e9)
                    stamp_s = (payload.stamp_ns - origin_ns) * 1e-9
                imu.append(
                    (stamp_s, payload.rate_body_rad_s, *payload.force_body_m_s2, payload.temperature_c)
                )
            case m.StarFix(fix=True) if imu:
                stars.append((stamp_s, logged_s, payload.x_m, payload.y_m, payload.heading_rad))
                covariance.append(payload.covariance)
            case m.ReferenceState() if imu:
                reference.append((stamp_s, *payload.position_table_m, payload.heading_rad))
            case m.ValveStatus(floating=True) if imu:
                floats_s = min(floats_s, logged_s)
    if not imu:
        raise UsageError(f"{source} holds no valid sample of {vehicle}.")
    noise, camera = rig_noise(rig, vehicle), rig.mock_up_of(vehicle).star_camera
    floor_m, floor_rad = fix_floor_of(rig, vehicle)
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
        0.0 if camera is None else camera.delay_s,
    )
