"""The emulated twin: where a mock-up really is becomes lines on a wire, as the device would send them.

It knows the wire format and the emulator's truth, and nothing of the ground station.
"""

import math
from collections import deque
from typing import Annotated

import numpy as np
from pydantic import Field

from drivers.laboratory import ChannelKind
from firmware_emulator.device_kind import DeviceKind
from firmware_emulator.devices.pending import take_until
from firmware_emulator.failures import FailureKind, Parameter
from firmware_emulator.scenario import MockUp
from firmware_emulator.settings import NonNegative, Pair, Positive, Settings
from range_finder.protocol import NUMBERS, Reading, encode

NS_PER_S = 1_000_000_000
BYTE_NS = 10 * NS_PER_S // 115200  # start, eight data, stop


class RangeFinderConfig(Settings):
    """Table `range_finder` of a vehicle in `[[laboratory.vehicles]]`."""

    rate_hz: Annotated[float, Field(gt=0.0, le=100.0)] = 10.0
    sigma_m: NonNegative = 0.003
    position_body_m: Pair = (0.15, 0.0)
    reach_m: Positive = 8.0
    walls_m: tuple[float, float, float, float] = (-3.0, 3.0, -2.5, 2.5)
    """x_min, x_max, y_min, y_max of the room's walls, table frame."""


class RangeFinder:
    """Measures along body +x to the walls of the room, at a fixed rate."""

    def __init__(self, mock_up: MockUp, config: RangeFinderConfig) -> None:
        self._mock_up, self._config = mock_up, config
        self._rng: np.random.Generator = mock_up.random("range finder")
        self._period_ns = round(NS_PER_S / config.rate_hz)
        self._number = 0
        self._pending: deque[tuple[int, bytes]] = deque()
        self.next_ns = mock_up.start_ns + self._period_ns

    @property
    def next_output_ns(self) -> int:
        """When the next line may reach the host."""
        return self._pending[0][0] if self._pending else self.next_ns

    def take(self, until_ns: int) -> list[tuple[int, bytes]]:
        """Lines that reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def run(self, now_ns: int) -> None:
        """Measure."""
        noise_m = self._config.sigma_m * self._rng.standard_normal()  # drawn in any case
        truth_m = self._truth_m(now_ns)
        blocked = self._mock_up.failures.active("blocked_beam", now_ns - self._mock_up.start_ns)
        if blocked:
            truth_m = min(truth_m, blocked.parameters["distance_m"])
        is_seen = truth_m <= self._config.reach_m
        line = encode(Reading(self._number, max(0.0, truth_m + noise_m) if is_seen else None))
        self._number = (self._number + 1) % NUMBERS
        self._pending.append((now_ns + len(line) * BYTE_NS, line))
        self.next_ns += self._period_ns

    def _truth_m(self, now_ns: int) -> float:
        motion = self._mock_up.vehicle.origin_at(now_ns)
        cosine, sine = math.cos(motion.heading_rad), math.sin(motion.heading_rad)
        ahead_m, left_m = self._config.position_body_m
        x_m = motion.x_m + cosine * ahead_m - sine * left_m
        y_m = motion.y_m + sine * ahead_m + cosine * left_m
        x_min, x_max, y_min, y_max = self._config.walls_m
        along_x = ((x_max if cosine > 0.0 else x_min) - x_m) / cosine if cosine else math.inf
        along_y = ((y_max if sine > 0.0 else y_min) - y_m) / sine if sine else math.inf
        return min(along_x, along_y)


def build(mock_up: MockUp, config: RangeFinderConfig) -> RangeFinder:
    """The device that a mock-up carries."""
    return RangeFinder(mock_up, config)


RANGE_FINDER = DeviceKind(
    name="range_finder",
    channel=ChannelKind.BYTES,
    per_vehicle=build,
    section="range_finder",
    settings=RangeFinderConfig,
    served_by="firmware_emulator.live.served:TcpServed",
    failures={
        "blocked_beam": FailureKind(
            "range_finder",
            "Something stands in the beam of the range finder.",
            {"distance_m": Parameter(0.1, 0.0, 100.0)},
        )
    },
)
