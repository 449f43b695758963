"""What goes wrong in one scenario: its failures, each of a kind of the table (`failure_kinds`).

Failures are injected here; faults are what the station detects. Devices ask `Failures.active` at their own
moments and draw from their own generators, so that a failure of one device does not move another's random
numbers.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import ConfigDict, Field, ValidationInfo, model_validator

from drivers.files.amounts import check_amounts
from drivers.files.plain_model import PlainModel
from firmware_emulator.failure_kinds import FAILURE_KINDS, FailureKind, Parameter, checked

__all__ = ["FAILURE_KINDS", "Failure", "FailureConfig", "FailureKind", "Failures", "Parameter", "checked"]

NS_PER_S = 1_000_000_000
_KEPT_NS = 60 * NS_PER_S  # a device asks about moments that lie back by an exposure or a line's queue


class FailureConfig(PlainModel):
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
        given = {name: value for name, value in self.parameters.items() if not math.isnan(value)}
        check_amounts({"start_s": self.start_s, "parameters": given})  # the table knows where NaN is allowed
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
