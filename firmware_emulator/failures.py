"""What can go wrong in the laboratory: the table of failure kinds, and the failures of one scenario.

A failure is data: a row of the scenario with a kind of this table, the vehicle it befalls, when, and its
parameters. Devices ask `Failures.active` at their own moments and draw from their own generators, so that a
failure of one device does not move another's random numbers.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class FailureKind:
    """A row of the table.

    Attributes:
        device: Whom it befalls: `serial`, `imu`, `camera`, `sky` (rendered pictures only),
            `overhead`, `valves`.
        says: What happens.
        parameters: Name to default value; a scenario may give these and no others.
    """

    device: str
    says: str
    parameters: Mapping[str, float]


FAILURE_KINDS: Mapping[str, FailureKind] = {
    "bit_flips": FailureKind("serial", "Bits of the IMU's line flip.", {"probability_per_bit": 1e-4}),
    "lost_bytes": FailureKind("serial", "Bytes of the IMU's line get lost.", {"probability_per_byte": 1e-3}),
    "half_frames": FailureKind("serial", "Frames break off in the middle.", {"probability_per_frame": 0.05}),
    "stuck_gyro": FailureKind("imu", "The gyro repeats one code.", {"code": math.nan}),
    "dead_tilt": FailureKind("imu", "A tilt chip forces its output out of its window.", {"axis": 0.0}),
    "dead_sky": FailureKind("camera", "The ceiling's lights are off; drawn fixes stop.", {}),
    "frozen_camera": FailureKind("camera", "The camera repeats one picture or pose.", {}),
    "silent_camera": FailureKind("camera", "The camera sends nothing.", {}),
    "false_lights": FailureKind("camera", "Lights that no catalogue knows; drawn fixes are wrong.",
                              {"count": 5.0}),
    "dead_star": FailureKind("sky", "One LED of the ceiling is dark.", {"star": 0.0}),
    "moved_star": FailureKind("sky", "One LED hangs elsewhere than in the list.",
                            {"star": 0.0, "dx_m": 0.01, "dy_m": 0.0}),
    "new_star": FailureKind("sky", "A light hangs where the list has none.", {"x_m": 0.0, "y_m": 0.0}),
    "hidden_discs": FailureKind("overhead", "Hands cover discs from the camera over the table.",
                              {"count": 3.0}),
    "stuck_open_valve": FailureKind("valves", "A valve stays open.", {"valve": 0.0}),
    "stuck_closed_valve": FailureKind("valves", "A valve does not open.", {"valve": 0.0}),
    "leaking_valve": FailureKind("valves", "A closed valve leaks.", {"valve": 0.0, "fraction": 0.1}),
    "silent_bus": FailureKind("valves", "The vehicle's CAN node hears and says nothing.", {}),
}  # fmt: skip
"""THE TABLE of failure kinds."""


class FailureConfig(BaseModel):
    """One failure of a scenario: a row of `[[laboratory.failures]]`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: str
    vehicle: str
    start_s: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0
    end_s: float = math.inf
    parameters: dict[str, float] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _is_a_row_of_the_table(self) -> "FailureConfig":
        if self.kind not in FAILURE_KINDS:
            raise ValueError(f"no failure of kind {self.kind!r}; the kinds are {', '.join(FAILURE_KINDS)}")
        known = FAILURE_KINDS[self.kind].parameters
        for name in self.parameters:
            if name not in known:
                names = ", ".join(known) or "none"
                raise ValueError(f"failure {self.kind!r} has no parameter {name!r}; it has {names}")
        for name, limit in (("valve", 7), ("axis", 1), ("star", 99_999)):
            if not 0 <= self.parameters.get(name, 0) <= limit:
                raise ValueError(f"parameter {name} of failure {self.kind!r} must lie in 0..{limit}")
        if self.end_s <= self.start_s:
            raise ValueError(f"failure {self.kind!r} ends (end_s) before it starts (start_s)")
        return self


@dataclass(frozen=True, slots=True)
class Failure:
    """A failure of one vehicle with every parameter filled in; active in [start_ns, end_ns)."""

    kind: str
    start_ns: int
    end_ns: int | None
    parameters: Mapping[str, float]

    def is_active(self, stamp_ns: int) -> bool:
        """Whether the failure is there at `stamp_ns` (laboratory time)."""
        return self.start_ns <= stamp_ns and (self.end_ns is None or stamp_ns < self.end_ns)


class Failures:
    """The failures of one vehicle, asked by its devices."""

    def __init__(self, failures: Iterable[Failure] = ()) -> None:
        self._by_kind: dict[str, list[Failure]] = {}
        for failure in failures:
            self._by_kind.setdefault(failure.kind, []).append(failure)

    @classmethod
    def of_vehicle(cls, rows: Iterable[FailureConfig], vehicle: str) -> "Failures":
        """The rows of a scenario that befall `vehicle`."""
        return cls(
            Failure(
                kind=row.kind,
                start_ns=round(row.start_s * NS_PER_S),
                end_ns=None if math.isinf(row.end_s) else round(row.end_s * NS_PER_S),
                parameters={**FAILURE_KINDS[row.kind].parameters, **row.parameters},
            )
            for row in rows
            if row.vehicle == vehicle
        )

    def has(self, kind: str) -> bool:
        """Whether the scenario holds such a failure at any time: lets devices skip the question."""
        return kind in self._by_kind

    def active(self, kind: str, stamp_ns: int) -> Failure | None:
        """The first failure of that kind that is there at `stamp_ns`, or None."""
        for failure in self._by_kind.get(kind, ()):
            if failure.is_active(stamp_ns):
                return failure
        return None

    def all_active(self, kind: str, stamp_ns: int) -> list[Failure]:
        """Every failure of that kind at `stamp_ns`: several valves may fail at once."""
        return [failure for failure in self._by_kind.get(kind, ()) if failure.is_active(stamp_ns)]

    def edges_ns(self, device: str) -> list[int]:
        """Moments at which a failure of `device` comes or goes, ascending."""
        return sorted(
            edge
            for kind, failures in self._by_kind.items()
            if FAILURE_KINDS[kind].device == device
            for failure in failures
            for edge in (failure.start_ns, failure.end_ns)
            if edge is not None
        )
