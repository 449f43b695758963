"""When the coils of the valves were energised, from the frames that were sent to the valve node.

By the rules of the valve bus (docs/interfaces/valve_bus.md, "What a node does"): a new pulse id sets every
valve's remaining on-time, an unchanged one changes nothing, silence closes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.messages import EVERY_VEHICLE, SILENCE_CLOSES_S, VALVES, Arm, Stop, ValveCommand
from drivers.valve_bus.protocol import decode

Array = NDArray[np.float64]

FRAME_BITS = 47
"""Of a frame without data, interframe space included (ISO 11898-1)."""
STUFFED = 1.1
"""Bit stuffing adds up to a fifth; a tenth is usual."""
_NS = 1_000_000_000
_MS = 1_000_000


@dataclass(frozen=True, slots=True, eq=False)
class CoilSpans:
    """Spans during which coils were energised, host time.

    Attributes:
        valve: (p,) whose.
        start_ns: (p,) from the moment when the frame was complete on the bus.
        stop_ns: (p,) until then.
    """

    valve: NDArray[np.intp]
    start_ns: NDArray[np.int64]
    stop_ns: NDArray[np.int64]


def coil_spans(frames: Iterable[tuple[int, int, bytes]], bus_index: int, bitrate: float) -> CoilSpans:
    """Lay the commands to one node out in time.

    Args:
        frames: Moment (ns), identifier and data of each frame that was sent to any node, in order.
        bus_index: Of the vehicle.
        bitrate: Of the bus.
    """
    closes_ns = round(SILENCE_CLOSES_S * _NS)
    spans: list[list[int]] = []
    newest: list[list[int] | None] = [None] * VALVES
    pulse_id, is_armed, free_ns, refreshed_ns = -1, False, 0, 0

    def close(now_ns: int) -> None:
        for span in newest:
            if span is not None:
                span[2] = min(span[2], now_ns)

    for sent_ns, identifier, data in frames:
        took_ns = round((FRAME_BITS + 8 * len(data)) * STUFFED / bitrate * _NS)
        now_ns = free_ns = max(sent_ns, free_ns) + took_ns
        match decode(CanFrame(identifier, data)):
            case Arm(vehicle=vehicle, is_armed=armed) if vehicle == bus_index:
                is_armed = armed
                if not armed:
                    close(now_ns)
            case Stop(vehicle=vehicle, grace_s=0.0) if vehicle in (bus_index, EVERY_VEHICLE):
                is_armed = False
                close(now_ns)
            case ValveCommand(vehicle=vehicle) as command if vehicle == bus_index:
                if now_ns - refreshed_ns > closes_ns:
                    close(refreshed_ns + closes_ns)
                refreshed_ns = now_ns
                if command.pulse_id == pulse_id:
                    continue
                pulse_id = command.pulse_id
                if not is_armed:
                    continue
                for valve, on_ms in enumerate(command.on_times_ms):
                    span = newest[valve]
                    if span is not None and span[2] > now_ns:
                        span[2] = now_ns + on_ms * _MS
                    elif on_ms:
                        newest[valve] = [valve, now_ns, now_ns + on_ms * _MS]
                        spans.append(newest[valve])  # type: ignore[arg-type]
    table = np.array(spans, dtype=np.int64).reshape(-1, 3)
    return CoilSpans(table[:, 0].astype(np.intp), table[:, 1], table[:, 2])
