"""Flights as a source of a study: flown in lockstep into recordings, and read back as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.errors import UsageError
from groundstation.fusion.flight_data import FlightData
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.imu.messages import Imu
from groundstation.parts.scenario.messages import ScenarioStatus
from groundstation.parts.stars.messages import StarFix
from groundstation.recording.reader import Recording
from groundstation.rig.read import load_rig, read_text
from groundstation.scenario.loading import made
from groundstation.scenario.running import fly_recorded, seed_for
from groundstation.scenario.scenario_file import WHAT, content_of
from groundstation.studies.study import Progress
from groundstation.watch.recorded_flight import opened, recorded_flight

Array = NDArray[np.float64]
FLIGHTS = "flights"
"""Folder of the recordings."""


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """A flight.

    Attributes:
        data: Packets, fixes and truth; s from the first sample.
        tries: Of the star tracker: exposure s, arrival s, 1 for a fix; shape (n, 3).
        states: As it was flown: s, x, y, heading, velocity x, y, rate; shape (k, 7).
        zero_s: When t = 0 of the scenario was.
    """

    data: FlightData
    tries: Array
    states: Array
    zero_s: float

    def truth(self, t_s: Array) -> Array:
        """Return x, y, heading, velocity x, y, rate by the reference at moments, shape (6, n)."""
        reference = self.data.reference.copy()
        reference[:, 3] = np.unwrap(reference[:, 3])
        return np.array([np.interp(t_s, reference[:, 0], row) for row in reference[:, 1:].T])


Sides = Mapping[str, Flown]
"""A flight of each side."""


@dataclass(frozen=True, slots=True)
class FlightRow:
    """A flight of a study, flown once for each side; a `Source`.

    Attributes:
        scenario: Its scenario file.
        rigs: The rig of each side.
    """

    scenario: Path
    rigs: Mapping[str, Path]

    @property
    def size(self) -> float:
        """How often it is flown."""
        return float(len(self.rigs))

    def make(self, name: str, folder: Path, progress: Progress) -> Sides:
        """Fly it; the recordings stay in the folder ``flights``.

        Raises:
            UsageError: A file is wrong, or a recording cannot be written.
            GroundStationError: A recording cannot be written any further.
        """
        recordings = folder / FLIGHTS
        recordings.mkdir(parents=True, exist_ok=True)
        flown: dict[str, Flown] = {}
        for side, rig in self.rigs.items():
            what, begun = f"flying {name}, {side} methods", len(flown) / len(self.rigs)

            def report(text: str, _: float, what: str = what, begun: float = begun) -> None:
                progress(f"{what}: {text}", begun)

            flown[side] = fly_flight(self.scenario, rig, recordings / f"{name}_{side}.mcap", report)
        return flown


def fly_flight(scenario_file: Path, rig_file: Path, recording: Path, progress: Progress) -> Flown:
    """Fly a scenario on a rig, and read it back.

    Args:
        scenario_file: The experiment; its own rig is not looked at.
        rig_file: The rig that flies it.
        recording: To write; one that is there already is replaced once the flight is over.
        progress: Called now and then.

    Raises:
        UsageError: A file is wrong, or the recording cannot be written.
        GroundStationError: It cannot be written any further.
    """
    content = content_of(read_text(scenario_file, WHAT), scenario_file)
    scenario = made(content, scenario_file, load_rig(rig_file))
    with TemporaryDirectory(dir=recording.parent, prefix=".part.") as unfinished:
        flying = Path(unfinished) / recording.name
        fly_recorded(scenario, seed_for(scenario, None), flying, progress)
        flying.replace(recording)
    return read_flown(recording)


def read_flown(recording: Path) -> Flown:
    """Read a recorded flight of a study.

    Raises:
        UsageError: It holds no vehicle.
        RecordingError: It cannot be read.
    """
    with opened(recording) as (source, rig):
        (vehicle,) = rig.vehicles
        data = recorded_flight(recording, source, rig, vehicle).tidied()
        return Flown(data, *_more(source, vehicle, recording))


def _more(source: Recording, vehicle: str, path: Path) -> tuple[Array, Array, float]:
    """Read the tries of the star tracker, the states and t = 0, on the clock of the flight's data."""
    origin_ns = zero_ns = 0
    tries: list[tuple[float, float, float]] = []
    states: list[tuple[float, ...]] = []
    for message in source.messages((Imu, StarFix, VehicleState, ScenarioStatus)):
        payload = message.payload
        match payload:
            case Imu(valid=True) if not origin_ns and payload.vehicle == vehicle:
                origin_ns = payload.stamp_ns - round(payload.window_s * 1e9)
            case StarFix() if origin_ns:
                exposure_s, arrival_s = payload.stamp_ns - origin_ns, message.log_ns - origin_ns
                tries.append((exposure_s * 1e-9, arrival_s * 1e-9, float(payload.fix)))
            case VehicleState() if origin_ns:
                pose = (*payload.position_table_m, payload.heading_rad)
                motion = (*payload.velocity_table_m_s, payload.rate_rad_s)
                states.append(((payload.stamp_ns - origin_ns) * 1e-9, *pose, *motion))
            case ScenarioStatus() if payload.zero_ns:
                zero_ns = payload.zero_ns
    if not zero_ns:
        raise UsageError(f"{path}: the flight never began.")
    flown = np.array(states).reshape(-1, 7)
    flown[:, 3] = np.unwrap(flown[:, 3])
    return np.array(tries).reshape(-1, 3), flown, (zero_ns - origin_ns) * 1e-9
