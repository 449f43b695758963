"""What people are shown of an IMU block: rate, losses, a line that is silent or full of noise."""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from groundstation.declarations.message import Message
from groundstation.declarations.view import (
    NOTHING,
    Array,
    Cell,
    Figure,
    Gauge,
    GaugeRow,
    Level,
    Newest,
    Wanted,
    cell,
)
from groundstation.parts.imu.messages import Imu
from groundstation.parts.operation.messages import Diagnostics

SILENT_S = 3.0
"""So long after its port was opened the block should have sent a frame."""


class ImuGauge(Gauge):
    """Rate and losses; reports a line on which nothing comes, or nothing but noise."""

    label = "IMU"
    every = (Diagnostics,)
    newest = (Imu,)
    rated = (Imu,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._port = f"{vehicle}/imu"
        self._open_since_ns: int | None = None
        self._bytes_seen = 0
        self._grows = False
        self._is_bad = False

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        assert isinstance(message, Diagnostics)
        if message.node == self._port:
            self._open_since_ns = message.stamp_ns if message.level == 0 else None
        elif message.node.startswith(f"{self.vehicle}/") and "bytes_seen" in message.keys:
            seen = int(message.values[message.keys.index("bytes_seen")])
            self._bytes_seen, self._grows = seen, seen > self._bytes_seen
        yield from ()

    def look(self, newest: Newest, now_ns: int) -> Iterator[str]:
        opened_ns, was_bad = self._open_since_ns, self._is_bad
        comes = newest.rate_hz(Imu, now_ns) > 0.0
        self._is_bad = opened_ns is not None and now_ns - opened_ns > SILENT_S * 1e9 and not comes
        if self._is_bad and not was_bad:
            what = (
                "noise and no frame: another baud rate, or another device?"
                if self._grows
                else "open, but no byte comes: is the block switched on?"
            )
            yield f"{self._port}: {what} Listening on"
        elif was_bad and comes:
            yield f"{self._port}: samples come"

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        imu = newest.get(Imu)
        if imu is None:
            return NOTHING
        rate_hz = newest.rate_hz(Imu, now_ns)
        shown = cell(f"{rate_hz:5.0f} /s", Level.PLAIN if rate_hz else Level.BAD)
        shown += cell(f"  {imu.frames_lost} lost", Level.WARNING if imu.frames_lost else Level.FAINT)
        return shown if imu.valid else shown + cell(f"  {imu.reason}", Level.BAD)

    def phrase(self, newest: Newest, now_ns: int) -> str:
        imu = newest.get(Imu)
        lost = 0 if imu is None else imu.frames_lost
        return f"imu {newest.rate_hz(Imu, now_ns):3.0f}/s lost {lost}"


class ImuFigure(Figure):
    """Frames seen and frames lost."""

    columns: ClassVar[Wanted] = {Imu: ("frames_lost",)}

    def __init__(self) -> None:
        self._frames = self._lost = 0

    def take_columns(self, kind: type[Message], t_s: Array, fields: Mapping[str, Array]) -> None:
        del kind
        self._frames = len(t_s)
        self._lost = int(fields["frames_lost"][-1])

    def values(self) -> dict[str, Any]:
        return {"imu_frames": self._frames, "imu_frames_lost": self._lost}


GAUGES = (GaugeRow(80, ImuGauge),)
