"""What can be made to go wrong in the laboratory: the table of kinds of failure, and those of one scenario.

Failures are injected here; faults are what the station detects. A failure is data: its kind, the vehicle it
befalls, when, and its parameters. Devices ask `Failures.active` at their own moments and draw from their own
generators, so that a failure of one device does not move another's random numbers.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, model_validator

NS_PER_S = 1_000_000_000
_KEPT_NS = 60 * NS_PER_S  # a device asks about moments that lie back by an exposure or a line's queue


@dataclass(frozen=True, slots=True)
class Parameter:
    """What a parameter of a failure may be.

    Attributes:
        default: Where nothing is given; NaN where that means something to the device.
        lowest, highest: Limits, both allowed.
        is_whole: Whether it is an index or a count.
    """

    default: float
    lowest: float
    highest: float
    is_whole: bool = False

    def complaint(self, value: float) -> str | None:
        """What is wrong with a value, or None."""
        if math.isnan(value) and math.isnan(self.default):
            return None
        if not self.lowest <= value <= self.highest:  # NaN too
            return f"must lie in {self.lowest:g}..{self.highest:g}, got {value:g}"
        if self.is_whole and value != int(value):
            return f"must be a whole number, got {value:g}"
        return None


@dataclass(frozen=True, slots=True)
class FailureKind:
    """A row of the table.

    Attributes:
        device: Whom it befalls: `serial`, `imu`, `camera`, `sky` (rendered pictures only),
            `overhead`, `valves`.
        effect: What happens, in a sentence.
        parameters: By name; a scenario or an order may give these and no others.
    """

    device: str
    effect: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)


_VALVE = Parameter(0.0, 0.0, 7.0, is_whole=True)
_STAR = Parameter(0.0, 0.0, 99_999.0, is_whole=True)
_PLACE_M = Parameter(0.0, -100.0, 100.0)


def _share(default: float) -> Parameter:
    return Parameter(default, 0.0, 1.0)


def _count(default: float) -> Parameter:
    return Parameter(default, 0.0, 1000.0, is_whole=True)


FAILURE_KINDS: Mapping[str, FailureKind] = {
    "bit_flips": FailureKind("serial", "Bits of the IMU's line flip.", {"probability_per_bit": _share(1e-4)}),
    "lost_bytes": FailureKind("serial", "Bytes of the IMU's line get lost.",
                              {"probability_per_byte": _share(1e-3)}),
    "half_frames": FailureKind("serial", "Frames break off in the middle.",
                               {"probability_per_frame": _share(0.05)}),
    "stuck_gyro": FailureKind("imu", "The gyro repeats one code.",
                              {"code": Parameter(math.nan, 0.0, 4095.0, is_whole=True)}),
    "dead_tilt": FailureKind("imu", "A tilt chip forces its output out of its window.",
                             {"axis": Parameter(0.0, 0.0, 1.0, is_whole=True)}),
    "dead_sky": FailureKind("camera", "The ceiling's lights are off; drawn fixes stop."),
    "frozen_camera": FailureKind("camera", "The camera repeats one picture or pose."),
    "silent_camera": FailureKind("camera", "The camera sends nothing."),
    "false_lights": FailureKind("camera", "Lights that no catalogue knows; drawn fixes are wrong.",
                                {"count": _count(5.0)}),
    "dead_star": FailureKind("sky", "One LED of the ceiling is dark.", {"star": _STAR}),
    "moved_star": FailureKind("sky", "One LED hangs elsewhere than in the list.",
                              {"star": _STAR, "dx_m": Parameter(0.01, -100.0, 100.0), "dy_m": _PLACE_M}),
    "new_star": FailureKind("sky", "A light hangs where the list has none.",
                            {"x_m": _PLACE_M, "y_m": _PLACE_M}),
    "hidden_discs": FailureKind("overhead", "Hands cover discs from the camera over the table.",
                                {"count": _count(3.0)}),
    "stuck_open_valve": FailureKind("valves", "A valve stays open.", {"valve": _VALVE}),
    "stuck_closed_valve": FailureKind("valves", "A valve does not open.", {"valve": _VALVE}),
    "leaking_valve": FailureKind("valves", "A closed valve leaks.",
                                 {"valve": _VALVE, "fraction": _share(0.1)}),
    "silent_bus": FailureKind("valves", "The vehicle's CAN node receives and sends nothing."),
}  # fmt: skip
"""THE TABLE of the emulator's own kinds of failure; a kind of device may bring more."""


def checked(kind: str, given: Mapping[str, float], kinds: Mapping[str, FailureKind]) -> dict[str, float]:
    """All parameters of a failure, defaults filled in.

    Raises:
        ValueError: There is no such kind or parameter, or a value is impossible; one sentence names it.
    """
    if kind not in kinds:
        raise ValueError(f"no failure of kind {kind!r}; the kinds are {', '.join(kinds)}")
    known = kinds[kind].parameters
    for name, value in given.items():
        if name not in known:
            raise ValueError(
                f"failure {kind!r} has no parameter {name!r}; it has {', '.join(known) or 'none'}"
            )
        complaint = known[name].complaint(value)
        if complaint:
            raise ValueError(f"parameter {name} of failure {kind!r} {complaint}")
    return {name: given.get(name, parameter.default) for name, parameter in known.items()}


class FailureConfig(BaseModel):
    """One failure of a scenario: a row of `[[laboratory.failures]]`.

    After reading, `parameters` holds all of the kind's. Kinds are those of the validation context's
    `failure_kinds`; without a context, the emulator's own.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: str
    vehicle: str
    start_s: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0
    end_s: float = math.inf
    parameters: dict[str, float] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _is_a_row_of_the_table(self, info: ValidationInfo) -> "FailureConfig":
        kinds = (info.context or {}).get("failure_kinds", FAILURE_KINDS)
        filled = checked(self.kind, self.parameters, kinds)
        if not self.end_s > self.start_s:
            raise ValueError(f"failure {self.kind!r} ends (end_s) before it starts (start_s)")
        self.parameters.update(filled)
        return self


@dataclass(frozen=True, slots=True)
class Failure:
    """A failure of one vehicle with every parameter filled in; active in [start_ns, end_ns).

    Times count from when the laboratory was switched on.
    """

    kind: str
    start_ns: int
    end_ns: int | None
    parameters: Mapping[str, float]

    def is_active(self, stamp_ns: int) -> bool:
        """Whether the failure is there at `stamp_ns`."""
        return self.start_ns <= stamp_ns and (self.end_ns is None or stamp_ns < self.end_ns)


class Failures:
    """The failures of one vehicle, asked by its devices; more may come at run time."""

    def __init__(self, failures: Iterable[Failure] = ()) -> None:
        self._by_kind: dict[str, list[Failure]] = {}
        self._watchers: dict[str, list[Callable[[int], None]]] = {}
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
                parameters=row.parameters,
            )
            for row in rows
            if row.vehicle == vehicle
        )

    def add(self, failure: Failure) -> None:
        """A failure more; what ended long before it is forgotten."""
        horizon_ns = failure.start_ns - _KEPT_NS
        rows = self._by_kind.setdefault(failure.kind, [])
        rows[:] = [row for row in rows if row.end_ns is None or row.end_ns > horizon_ns]
        rows.append(failure)

    def all(self) -> list[Failure]:
        """Every failure known so far, kind by kind."""
        return [failure for rows in self._by_kind.values() for failure in rows]

    def watch(self, device: str, callback: Callable[[int], None]) -> None:
        """Let `callback(stamp_ns)` (laboratory time) be called when a failure of `device` begins or ends."""
        self._watchers.setdefault(device, []).append(callback)

    def report(self, device: str, stamp_ns: int) -> None:
        """Call those who watch `device`."""
        for callback in self._watchers.get(device, ()):
            callback(stamp_ns)

    def has(self, *kinds: str) -> bool:
        """Whether there is such a failure at any time known so far: lets devices skip the question."""
        return not self._by_kind.keys().isdisjoint(kinds)

    def active(self, kind: str, stamp_ns: int) -> Failure | None:
        """The first failure of that kind that is there at `stamp_ns`, or None."""
        for failure in self._by_kind.get(kind, ()):
            if failure.is_active(stamp_ns):
                return failure
        return None

    def all_active(self, kind: str, stamp_ns: int) -> list[Failure]:
        """Every failure of that kind at `stamp_ns`: several valves may fail at once."""
        return [failure for failure in self._by_kind.get(kind, ()) if failure.is_active(stamp_ns)]
