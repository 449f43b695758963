"""What can go wrong in the laboratory: the table of fault kinds, and the faults of one scenario.

A fault is data: a row of the scenario with a kind of this table, the vehicle it befalls, when, and its
parameters. Devices ask `Faults.active` at their own moments and draw from their own generators, so that a
fault of one device does not move another's random numbers.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class FaultKind:
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


FAULT_KINDS: Mapping[str, FaultKind] = {
    "bit_flips": FaultKind("serial", "Bits of the IMU's line flip.", {"probability_per_bit": 1e-4}),
    "lost_bytes": FaultKind("serial", "Bytes of the IMU's line get lost.", {"probability_per_byte": 1e-3}),
    "half_frames": FaultKind("serial", "Frames break off in the middle.", {"probability_per_frame": 0.05}),
    "stuck_gyro": FaultKind("imu", "The gyro repeats one code.", {"code": math.nan}),
    "dead_tilt": FaultKind("imu", "A tilt chip forces its output out of its window.", {"axis": 0.0}),
    "dead_sky": FaultKind("camera", "The ceiling's lights are off; drawn fixes stop.", {}),
    "frozen_camera": FaultKind("camera", "The camera repeats one picture or pose.", {}),
    "silent_camera": FaultKind("camera", "The camera sends nothing.", {}),
    "false_lights": FaultKind("camera", "Lights that no catalogue knows; drawn fixes are wrong.",
                              {"count": 5.0}),
    "dead_star": FaultKind("sky", "One LED of the ceiling is dark.", {"star": 0.0}),
    "moved_star": FaultKind("sky", "One LED hangs elsewhere than in the list.",
                            {"star": 0.0, "dx_m": 0.01, "dy_m": 0.0}),
    "new_star": FaultKind("sky", "A light hangs where the list has none.", {"x_m": 0.0, "y_m": 0.0}),
    "hidden_discs": FaultKind("overhead", "Hands cover discs from the camera over the table.",
                              {"count": 3.0}),
    "stuck_open_valve": FaultKind("valves", "A valve stays open.", {"valve": 0.0}),
    "stuck_closed_valve": FaultKind("valves", "A valve does not open.", {"valve": 0.0}),
    "leaking_valve": FaultKind("valves", "A closed valve leaks.", {"valve": 0.0, "fraction": 0.1}),
    "silent_bus": FaultKind("valves", "The vehicle's CAN node hears and says nothing.", {}),
}  # fmt: skip
"""THE TABLE of fault kinds."""


class FaultConfig(BaseModel):
    """One fault of a scenario: a row of `[[laboratory.faults]]`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: str
    vehicle: str
    start_s: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0
    end_s: float = math.inf
    parameters: dict[str, float] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _is_a_row_of_the_table(self) -> "FaultConfig":
        if self.kind not in FAULT_KINDS:
            raise ValueError(f"no fault of kind {self.kind!r}; the kinds are {', '.join(FAULT_KINDS)}")
        known = FAULT_KINDS[self.kind].parameters
        for name in self.parameters:
            if name not in known:
                names = ", ".join(known) or "none"
                raise ValueError(f"fault {self.kind!r} has no parameter {name!r}; it has {names}")
        for name, limit in (("valve", 7), ("axis", 1), ("star", 99_999)):
            if not 0 <= self.parameters.get(name, 0) <= limit:
                raise ValueError(f"parameter {name} of fault {self.kind!r} must lie in 0..{limit}")
        if self.end_s <= self.start_s:
            raise ValueError(f"fault {self.kind!r} ends (end_s) before it starts (start_s)")
        return self


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault of one vehicle with every parameter filled in; active in [start_ns, end_ns)."""

    kind: str
    start_ns: int
    end_ns: int | None
    parameters: Mapping[str, float]

    def is_active(self, stamp_ns: int) -> bool:
        """Whether the fault is there at `stamp_ns` (laboratory time)."""
        return self.start_ns <= stamp_ns and (self.end_ns is None or stamp_ns < self.end_ns)


class Faults:
    """The faults of one vehicle, asked by its devices."""

    def __init__(self, faults: Iterable[Fault] = ()) -> None:
        self._by_kind: dict[str, list[Fault]] = {}
        for fault in faults:
            self._by_kind.setdefault(fault.kind, []).append(fault)

    @classmethod
    def of_vehicle(cls, rows: Iterable[FaultConfig], vehicle: str) -> "Faults":
        """The rows of a scenario that befall `vehicle`."""
        return cls(
            Fault(
                kind=row.kind,
                start_ns=round(row.start_s * NS_PER_S),
                end_ns=None if math.isinf(row.end_s) else round(row.end_s * NS_PER_S),
                parameters={**FAULT_KINDS[row.kind].parameters, **row.parameters},
            )
            for row in rows
            if row.vehicle == vehicle
        )

    def has(self, kind: str) -> bool:
        """Whether the scenario holds such a fault at any time: lets devices skip the question."""
        return kind in self._by_kind

    def active(self, kind: str, stamp_ns: int) -> Fault | None:
        """The first fault of that kind that is there at `stamp_ns`, or None."""
        for fault in self._by_kind.get(kind, ()):
            if fault.is_active(stamp_ns):
                return fault
        return None

    def all_active(self, kind: str, stamp_ns: int) -> list[Fault]:
        """Every fault of that kind at `stamp_ns`: several valves may fail at once."""
        return [fault for fault in self._by_kind.get(kind, ()) if fault.is_active(stamp_ns)]

    def edges_ns(self, device: str) -> list[int]:
        """Moments at which a fault of `device` comes or goes, ascending."""
        return sorted(
            edge
            for kind, faults in self._by_kind.items()
            if FAULT_KINDS[kind].device == device
            for fault in faults
            for edge in (fault.start_ns, fault.end_ns)
            if edge is not None
        )
