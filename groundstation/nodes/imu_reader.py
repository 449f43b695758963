"""IMU reader: bytes of the IMU block in, raw counts and calibrated samples out."""

import math
from collections.abc import Iterator

from drivers.imu_block.clock import TickClock, TickStamp
from drivers.imu_block.commands import encode_set_averaging
from drivers.imu_block.protocol import DEFAULT_V1_SAMPLE_COUNT, FrameParser, ImuFrame
from drivers.imu_block.sensors import Environment, Plausibility, rate_rad_s, specific_force_m_s2
from groundstation.messages.base import Message
from groundstation.messages.definitions import Diagnostics, Imu, ImuBytes, ImuOrder, ImuRaw
from groundstation.nodes.node import Node

PERIOD_NS = 1_000_000_000
TICK_S = 1e-3
VERSIONS = {"auto": None, "v1": 1, "v2": 2}
_NO_TILTS: tuple[float, ...] = ()


class ImuReader(Node):
    """Parses, stamps and scales; asks the block for the rig's averaging as long as it has another.

    Args:
        vehicle: Its name.
        version: ``auto``, ``v1`` or ``v2``.
        baud: Of the line.
        latency_timer_s: Of the USB adapter.
        averaging: Polls per frame. Version 2 says its own and is asked for this one if it differs;
            version 1 does not say, so this is what it is taken to have. None: as it comes, or 8.
    """

    inputs = (ImuBytes,)
    outputs = (ImuRaw, Imu, ImuOrder, Diagnostics)

    def __init__(
        self, vehicle: str, version: str, baud: int, latency_timer_s: float, averaging: int | None
    ) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self._parser = FrameParser(VERSIONS[version], v1_sample_count=averaging or DEFAULT_V1_SAMPLE_COUNT)
        self._clock = TickClock(baud, latency_timer_s=latency_timer_s)
        self._plausibility = Plausibility()
        self._environment = Environment()
        self._averaging = averaging
        self._seen_averaging: int | None = None
        self._tag = 0

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        assert isinstance(message, ImuBytes)
        found = self._parser.feed(message.data)
        frames = [frame for frame in found if isinstance(frame, ImuFrame)]
        stamps = self._clock.update(message.stamp_ns, len(message.data), frames)
        for frame, stamp in zip(frames, stamps, strict=True):
            self._environment.update(frame)
            yield self._raw(frame, stamp)
            yield self._sample(frame, stamp)

    def tick(self, now_ns: int) -> Iterator[Message]:
        counters = self._parser.counters.as_dict()
        keys, values = tuple(counters), tuple(str(count) for count in counters.values())
        yield Diagnostics(now_ns, self.vehicle, f"{self.vehicle}/imu_reader", 0, "", keys, values)
        if self._averaging is not None and self._seen_averaging not in (None, self._averaging):
            self._tag = (self._tag + 1) % 256
            yield ImuOrder(now_ns, self.vehicle, encode_set_averaging(self._tag, self._averaging))

    def _raw(self, frame: ImuFrame, stamp: TickStamp) -> ImuRaw:
        return ImuRaw(
            stamp.stamp_ns,
            self.vehicle,
            frame.version,
            stamp.tick,
            frame.sample_count,
            frame.gyro_counts,
            frame.tilt_counts or _NO_TILTS,
            frame.tilt_difference_counts,
            int(self._environment.status),
        )

    def _sample(self, frame: ImuFrame, stamp: TickStamp) -> Imu:
        faults = self._plausibility.update(frame, self._environment.status)
        self._seen_averaging = frame.sample_count if frame.version > 1 else self._averaging
        x, y = frame.tilt_difference_counts
        return Imu(
            stamp.stamp_ns,
            self.vehicle,
            stamp.tick,
            stamp.elapsed_ticks or 0,
            frame.sample_count * TICK_S,
            stamp.stamp_std_s,
            rate_rad_s(frame.gyro_counts),
            (specific_force_m_s2(x), specific_force_m_s2(y)),
            self._temperature_c(),
            not faults,
            faults.name.lower() if faults.name else "",
            self._parser.counters.frames_lost,
        )

    def _temperature_c(self) -> float:
        """Mean of the chips that have spoken, NaN before (and for ever with version 1)."""
        seen = self._environment
        chips = (seen.temperature_gyro_c, seen.temperature_tilt_x_c, seen.temperature_tilt_y_c)
        known = [value for value in chips if not math.isnan(value)]
        return sum(known) / len(known) if known else math.nan
