"""What devices are built from: the scenario with its random numbers, and the mock-ups that carry them."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from firmware_emulator.config import LaboratoryConfig
from firmware_emulator.failures import FailureKind, Failures
from firmware_emulator.mock_up_config import VehicleConfig
from firmware_emulator.plant.motion_state import PollGrid
from firmware_emulator.plant.rigid_body import Vehicle

_LABORATORY_STREAM = 0  # spawn keys: the laboratory's own streams, then the vehicles' from 1
# Parts that had their numbers before parts had names; every other part's key is made from its name.
_LABORATORY_NUMBERS = {"surface": 0, "overhead_camera": 1}
_VEHICLE_NUMBERS = {
    "crystal": 0,
    "valves": 1,
    "node": 2,
    "imu errors": 3,
    "imu noise": 4,
    "line": 5,
    "housekeeping": 6,
    "camera": 7,
}


@dataclass(frozen=True, slots=True)
class Scenario:
    """The scenario as it was read, and the seed of this run.

    Attributes:
        config: The `[laboratory]` table.
        seed: Decides every random number, together with `seed` of the table.
        start_ns: Laboratory time at which everything is switched on.
    """

    config: LaboratoryConfig
    seed: int = 0
    start_ns: int = 0

    @property
    def seed_words(self) -> list[int]:
        """Both seeds, for whoever makes random numbers in another process."""
        return [self.seed, self.config.seed]

    def random(self, part: str) -> np.random.Generator:
        """A generator of its own for each named part of the laboratory: no part's draws shift another's."""
        return self._generator(_LABORATORY_STREAM, 0, part, _LABORATORY_NUMBERS)

    def random_of_vehicle(self, index: int, part: str) -> np.random.Generator:
        """The same for a named part of a vehicle."""
        offset = self.config.vehicles[index].seed_offset
        return self._generator(1 + index, offset, part, _VEHICLE_NUMBERS)

    def _generator(
        self, stream: int, offset: int, part: str, numbers: Mapping[str, int]
    ) -> np.random.Generator:
        key = (numbers[part],) if part in numbers else _words(part)
        seeds = np.random.SeedSequence(self.seed_words, spawn_key=(stream, offset, *key))
        return np.random.default_rng(seeds)


@dataclass(frozen=True, slots=True)
class MockUp:
    """A vehicle on the table, ready to carry devices.

    Attributes:
        index: Its place in the scenario, and on the valve bus.
        config: Its table of the rig.
        vehicle: The truth about it.
        grid: Moments at which its IMU block polls.
        failures: Those that befall it.
        scenario: All the rest.
    """

    index: int
    config: VehicleConfig
    vehicle: Vehicle
    grid: PollGrid
    failures: Failures
    scenario: Scenario

    @property
    def name(self) -> str:
        """Its name, and the first part of its channels' names."""
        return self.config.name

    @property
    def start_ns(self) -> int:
        """Laboratory time of power-up."""
        return self.scenario.start_ns

    def random(self, part: str) -> np.random.Generator:
        """A generator of its own for each named part."""
        return self.scenario.random_of_vehicle(self.index, part)


@dataclass(frozen=True, slots=True)
class Site:
    """The laboratory around the mock-ups, for devices that all of them share.

    Attributes:
        scenario: What it was read from.
        mock_ups: On the table.
        failure_kinds: Every kind of failure that can be injected, by name.
    """

    scenario: Scenario
    mock_ups: tuple[MockUp, ...]
    failure_kinds: Mapping[str, FailureKind]


def _words(part: str) -> tuple[int, ...]:
    """Four words made from a name; longer than a number, so that they meet none."""
    digest = hashlib.sha256(part.encode()).digest()
    return tuple(int.from_bytes(digest[start : start + 4], "little") for start in range(0, 16, 4))
