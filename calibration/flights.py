"""From a recording (.mcap) or a data folder to flights: the one way in for every calibration."""

from __future__ import annotations

from pathlib import Path

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.declarations.rig import Rig
from groundstation.fusion.estimator import Estimator
from groundstation.fusion.flight_data import FlightData
from groundstation.parts.fusion.part import fusion_node
from groundstation.parts.stars.sections import StarsOfVehicle
from groundstation.recording.reader import Recording
from groundstation.runners.replay import ReplayRunner
from groundstation.watch.recorded_flight import one_of, opened, recorded_flight

__all__ = ["fuse", "opened", "read_flight"]


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
        chosen = one_of(source, names, vehicle, "star cameras fly on" if rates_only else "there are")
        return recorded_flight(source, recording, rig, chosen, rates_only=rates_only).tidied()


def fuse(recording: Recording, rig: Rig, vehicle: str, estimator: Estimator) -> None:
    """Replay the fusion node of a vehicle with another estimator: it is given what it was given then.

    Raises:
        UsageError: The recording holds no fusion of this vehicle, or not what it received.
    """
    key = f"{vehicle}/fusion"
    ReplayRunner(recording, lambda _key: fusion_node(rig, vehicle, estimator), [key]).run()
