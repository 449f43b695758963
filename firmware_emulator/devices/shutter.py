"""A camera of the laboratory: its shutter opens and closes, and some time later a picture is at the host.

What a picture shows is drawn elsewhere, so pictures may be drawn at once (lockstep) or by another process
(live); what moves while the shutter is open is the business of each camera.
"""

from abc import ABC, abstractmethod
from collections import deque
from typing import Annotated, Generic, Literal, Protocol, TypeVar

import numpy as np
from pydantic import Field, model_validator

from firmware_emulator.devices.pending import take_until
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import NS_PER_S
from firmware_emulator.settings import NonNegative, Positive, Settings

Pose = tuple[float, float, float]
"""x, y (m) and heading (rad) of a body's origin in the table frame."""
_JITTER_LIMIT = 6.0  # standard deviations


class Exposed(Protocol):
    """What one exposure has given."""

    @property
    def arrival_ns(self) -> int:
        """When its picture reaches the host."""


PlaceT = TypeVar("PlaceT")
ExposureT = TypeVar("ExposureT", bound=Exposed)


class PictureSettings(Settings):
    """Keys of a camera whose rows are all exposed at once; each camera has defaults of its own."""

    rate_hz: Positive
    exposure_s: Positive
    delay_s: Annotated[float, Field(ge=0.0, le=4.0)] = 0.02
    """From the middle of the exposure to the host."""
    delay_jitter_s: NonNegative = 0.001
    stream: Literal["raw", "mjpeg"] = "raw"
    """How live pictures are served over HTTP."""
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] = 95

    @model_validator(mode="after")
    def _exposure_fits_the_rate(self) -> "PictureSettings":
        if self.exposure_s * self.rate_hz >= 1.0:
            raise ValueError(
                f"exposure_s = {self.exposure_s:g} s is longer than a period of rate_hz = {self.rate_hz:g}"
            )
        return self


class Shutter(ABC, Generic[PlaceT, ExposureT]):
    """Timing of the exposures, and what is under way to the host.

    Args:
        rate_hz: Pictures per second.
        open_s: From the moment the shutter opens until it has closed.
        delay_s: From the middle between the two until the picture is at the host.
        delay_jitter_s: Its standard deviation.
        rng: For the jitter.
        start_ns: When the laboratory began.
        first_share: Of a period, until the first exposure begins.
    """

    def __init__(
        self,
        rate_hz: float,
        open_s: float,
        delay_s: float,
        delay_jitter_s: float,
        rng: np.random.Generator,
        start_ns: int,
        first_share: float,
    ) -> None:
        self._period_ns = round(NS_PER_S / rate_hz)
        self._open_ns = round(open_s * NS_PER_S)
        self._delay_ns = round(delay_s * NS_PER_S)
        self._jitter_ns = delay_jitter_s * NS_PER_S
        self._rng, self._start_ns = rng, start_ns
        self._opens_ns = start_ns + int(self._period_ns * first_share)
        self._before: PlaceT | None = None
        self._sequence = 0
        self._last_arrival_ns = 0
        self._pending: deque[tuple[int, ExposureT]] = deque()

    @property
    def next_ns(self) -> int:
        """When the shutter next moves."""
        return self._opens_ns if self._before is None else self._opens_ns + self._open_ns

    @property
    def next_output_ns(self) -> int:
        """When the next picture may reach the host."""
        if self._pending:
            return self._pending[0][0]
        early_ns = self._opens_ns + self._open_ns // 2 + self._delay_ns
        return max(self._opens_ns + self._open_ns, early_ns - round(_JITTER_LIMIT * self._jitter_ns))

    def run(self, now_ns: int) -> None:
        """Open or close the shutter."""
        if self._before is None:
            self._before = self._places(now_ns)
            return
        before, after = self._before, self._places(now_ns)
        self._before = None
        middle_ns = self._opens_ns + self._open_ns // 2
        age_ns = middle_ns - self._start_ns
        self._opens_ns += self._period_ns
        jitter = float(np.clip(self._rng.standard_normal(), -_JITTER_LIMIT, _JITTER_LIMIT))
        late_ns = self._delay_ns + self._held_up_ns(age_ns)
        arrival_ns = max(now_ns, middle_ns + late_ns + round(jitter * self._jitter_ns))
        self._last_arrival_ns = max(self._last_arrival_ns + 1, arrival_ns)
        exposure = self._exposed(before, after, middle_ns, age_ns)
        self._sequence += 1
        if exposure is not None:
            self._pending.append((exposure.arrival_ns, exposure))

    def take(self, until_ns: int) -> list[tuple[int, ExposureT]]:
        """Exposures whose pictures reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def take_exposed(self) -> list[ExposureT]:
        """Exposures taken so far, ahead of their arrival: for one who draws them elsewhere."""
        taken = [exposure for _, exposure in self._pending]
        self._pending.clear()
        return taken

    @abstractmethod
    def _places(self, now_ns: int) -> PlaceT:
        """Where everything that is looked at is at a moment."""

    @abstractmethod
    def _exposed(self, before: PlaceT, after: PlaceT, middle_ns: int, age_ns: int) -> ExposureT | None:
        """What is sent of the exposure between two moments; None for nothing.

        Args:
            before: Places when the shutter opened.
            after: Places when it closed.
            middle_ns: Middle of the exposure.
            age_ns: The same, since the laboratory began.
        """

    def _held_up_ns(self, age_ns: int) -> int:
        """How much later than usual a picture is."""
        del age_ns
        return 0


def pose_of(vehicle: Vehicle, now_ns: int) -> Pose:
    """Where the origin of a mock-up is."""
    motion = vehicle.origin_at(now_ns)
    return motion.x_m, motion.y_m, motion.heading_rad
