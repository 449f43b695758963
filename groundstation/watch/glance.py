"""What a person asks first of a running rig: modes, air, gas, faults, who has control, recorder, latency."""

import math
from collections.abc import Iterator
from typing import Any

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.record_stream import Recorded
from groundstation.declarations.lease import Lease
from groundstation.declarations.message import Message
from groundstation.declarations.names import RECORDER
from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.parts.operation.messages import Diagnostics, Latency, RecorderStatus
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveStatus

OF_A_VEHICLE: tuple[type[Message], ...] = (
    Supervision, Faults, ValveStatus, VehicleState, FusionStatus, Latency,
)  # fmt: skip
OF_THE_RIG: tuple[type[Message], ...] = (Lease, RecorderStatus)
OF_A_PROCESS: tuple[type[Message], ...] = (Diagnostics,)
KINDS: dict[str, type[Message]] = {
    kind.TOPIC.noun: kind for kind in (*OF_A_VEHICLE, *OF_THE_RIG, *OF_A_PROCESS)
}
ERROR = 2
"""Level of diagnostics: what reports does not do what it is there for."""
LIGHT_TO_VALVE = "bus"
"""Stage of the ledger where the light that came in leaves as a command."""


class Glance:
    """Keeps the newest of each topic.

    Args:
        vehicles: Of the rig.

    Attributes:
        undecodable: Messages that do not fit the layout of their class.
    """

    def __init__(self, vehicles: tuple[str, ...]) -> None:
        self._vehicles = vehicles
        self._newest: dict[tuple[str, str], Message] = {}
        self.undecodable = 0

    def take(self, recorded: Recorded) -> None:
        """Account for a message."""
        kind = KINDS.get(recorded.noun)
        if kind is None:
            return
        try:
            self._newest[recorded.noun, recorded.owner] = codec_of(kind).decode(recorded.data)
        except CodecError:
            self.undecodable += 1

    @property
    def is_complete(self) -> bool:
        """Whether there is something of everything."""
        wanted = [(kind.TOPIC.noun, name) for kind in OF_A_VEHICLE for name in self._vehicles]
        wanted += [(kind.TOPIC.noun, "") for kind in OF_THE_RIG]
        wanted.append((Diagnostics.TOPIC.noun, RECORDER))
        return all(key in self._newest for key in wanted)

    def as_dict(self, now_ns: int) -> dict[str, Any]:
        """What is known, SI, None for what is not.

        Args:
            now_ns: Host monotonic clock.
        """
        return {
            "control": self._control(now_ns),
            "recorder": self._recorder(),
            "vehicles": {name: dict(self._vehicle(name, now_ns)) for name in self._vehicles},
        }

    def _get(self, kind: type[Message], owner: str = "") -> Any:  # noqa: ANN401 - one of many classes
        return self._newest.get((kind.TOPIC.noun, owner))

    def _control(self, now_ns: int) -> dict[str, Any]:
        lease: Lease | None = self._get(Lease)
        if lease is None:
            return {"holder": None, "expires_s": None}
        left_s = (lease.expires_ns - now_ns) * 1e-9
        holder = lease.holder if left_s > 0.0 else ""
        return {"holder": holder, "expires_s": left_s if holder else None}

    def _recorder(self) -> dict[str, Any] | None:
        status: RecorderStatus | None = self._get(RecorderStatus)
        health: Diagnostics | None = self._get(Diagnostics, RECORDER)
        if status is None:
            return None
        return {
            "is_stopped": health is not None and health.level >= ERROR,
            "trouble": health.summary if health is not None else "",
            "path": status.path,
            "written_bytes": status.written_bytes,
            "free_bytes": status.free_bytes,
            "room_s": _finite(status.room_s),
        }

    def _vehicle(self, name: str, now_ns: int) -> Iterator[tuple[str, Any]]:
        ruling: Supervision | None = self._get(Supervision, name)
        valves: ValveStatus | None = self._get(ValveStatus, name)
        state: VehicleState | None = self._get(VehicleState, name)
        fusion: FusionStatus | None = self._get(FusionStatus, name)
        latency: Latency | None = self._get(Latency, name)
        yield "mode", ruling and ruling.mode
        yield "cause", ruling and ruling.cause
        yield "author", ruling and ruling.author
        yield "waits_for", ruling and list(ruling.waits_for)
        yield "stop_latched", ruling and ruling.stop_latched
        yield "air_ordered", ruling and ruling.air_on
        yield "air_on", valves and valves.floating
        yield "pressure_pa", valves and _finite(valves.pressure_pa)
        yield "position_table_m", state and list(state.position_table_m)
        yield "heading_rad", state and state.heading_rad
        yield "state_age_s", state and (now_ns - state.stamp_ns) * 1e-9
        yield "fix_age_s", fusion and _finite(fusion.fix_age_s)
        yield "faults", self._faults(name, now_ns)
        yield "latency_s", latency and _latency(latency)

    def _faults(self, name: str, now_ns: int) -> list[dict[str, Any]] | None:
        faults: Faults | None = self._get(Faults, name)
        if faults is None:
            return None
        return [
            {
                "id": fault,
                "what": faults.whats[row],
                "detail": faults.details[row],
                "since_s": (now_ns - faults.since_ns[row]) * 1e-9,
                "response": faults.responses[row],
                "advice": faults.advices[row],
                "is_gone": faults.gone_ns[row] != 0.0,
            }
            for row, fault in enumerate(faults.ids)
        ]


def _latency(latency: Latency) -> dict[str, dict[str, float | None]]:
    rows = zip(latency.stages, latency.p50_s, latency.p99_s, strict=True)
    return {stage: {"p50": _finite(p50_s), "p99": _finite(p99_s)} for stage, p50_s, p99_s in rows}


def _finite(value: float) -> float | None:
    """A number that JSON knows."""
    return value if math.isfinite(value) else None
