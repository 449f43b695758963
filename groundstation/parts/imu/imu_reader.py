"""IMU reader: bytes of the IMU block in, raw counts and calibrated samples out."""

import math
from collections.abc import Iterator

from drivers.imu_block.block_commands import encode_identify, encode_set_averaging
from drivers.imu_block.clock import TickClock, TickStamp
from drivers.imu_block.protocol import FrameParser, Identity, ImuFrame
from drivers.imu_block.sensors import (
    Environment,
    Plausibility,
    rate_rad_s,
    specific_force_m_s2,
    usable_readings,
)
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.imu.messages import Imu, ImuBytes, ImuOrder, ImuRaw
from groundstation.parts.operation.messages import Diagnostics

PERIOD_NS = 500_000_000
DIAGNOSTICS_EVERY = 2
TICK_S = 1e-3
WORST_STAMP_S = 0.25
"""No link delays so unevenly: stamps this vague mean that the rig's averaging is not the block's."""
STRANGE_DRIFT = 250e-6
"""Beyond what two crystals are apart; turns that are integrated by such ticks are off by as much."""
OK, WARNING = 0, 1
VERSIONS = {"auto": None, "v1": 1, "v2": 2}
_NO_TILTS: tuple[float, ...] = ()


class ImuReader(Node):
    """Parses, stamps and scales; asks the block for the rig's averaging as long as it has another.

    Args:
        vehicle: Its name.
        version: ``auto``, ``v1`` or ``v2``.
        baud: Of the line.
        latency_timer_s: Of the USB adapter, where its driver does not report it.
        averaging: Polls per frame. Version 2 states its own and is asked for this one if it differs;
            version 1 does not state it, so this is what it is taken to have.
        serial_number: Of the block that belongs here, None if any may; version 1 cannot be asked.
        temperature_c: By an operator or another probe, for a block that sends none; NaN if unknown.
    """

    inputs = (ImuBytes,)
    outputs = (ImuRaw, Imu, ImuOrder, Diagnostics)

    def __init__(
        self,
        vehicle: str,
        version: str,
        baud: int,
        latency_timer_s: float,
        averaging: int,
        serial_number: int | None,
        temperature_c: float = math.nan,
    ) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self._parser = FrameParser(VERSIONS[version], v1_sample_count=averaging)
        self._clock = TickClock(baud, latency_timer_s=latency_timer_s)
        self._plausibility = Plausibility()
        self._environment = Environment()
        self._averaging = averaging
        self._seen_averaging: int | None = None
        self._serial_number = serial_number
        self._given_temperature_c = temperature_c
        self._found_number: int | None = None
        self._complaint = ""
        self._tag = self._ticks = 0

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        assert isinstance(message, ImuBytes)
        found = self._parser.feed(message.data)
        frames = []
        for each in found:
            if isinstance(each, ImuFrame):
                frames.append(each)
            elif isinstance(each, Identity):
                self._found_number = each.serial_number
        if not math.isnan(message.latency_timer_s):
            self._clock.measured_timer(message.latency_timer_s)
        stamps = self._clock.update(message.stamp_ns, len(message.data), frames)
        for frame, stamp in zip(frames, stamps, strict=True):
            self._environment.update(frame)
            yield self._raw(frame, stamp)
            yield self._sample(frame, stamp)

    def tick(self, now_ns: int) -> Iterator[Message]:
        self._ticks += 1
        if self._ticks % DIAGNOSTICS_EVERY == 0:
            yield self._diagnostics(now_ns)
        if self._parser.detected_version != 2:
            return
        self._tag = (self._tag + 1) % 256
        if self._seen_averaging not in (None, self._averaging):
            yield ImuOrder(now_ns, self.vehicle, encode_set_averaging(self._tag, self._averaging))
        elif self._serial_number is not None:  # again and again: blocks are swapped while it runs
            yield ImuOrder(now_ns, self.vehicle, encode_identify(self._tag))

    def _diagnostics(self, now_ns: int) -> Diagnostics:
        counters = self._parser.counters.as_dict()
        keys, values = tuple(counters), tuple(str(count) for count in counters.values())
        complaint = (
            f"samples are not believed: {self._complaint}" if self._complaint else self._strange_clock()
        )
        level = WARNING if complaint else OK
        summary = f"{self.vehicle}/imu: {complaint}" if complaint else ""
        return Diagnostics(now_ns, self.vehicle, f"{self.vehicle}/imu_reader", level, summary, keys, values)

    def _strange_clock(self) -> str:
        """In words, where the block's clock is certainly further off than any crystal; empty otherwise."""
        drift = self._clock.drift_ratio
        if abs(drift) - 3 * self._clock.drift_sigma < STRANGE_DRIFT:
            return ""
        return f"the block's clock is {100 * abs(drift):.2f} % {'slow' if drift > 0 else 'fast'}"

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
        self._seen_averaging = frame.sample_count
        objection = self._objection(stamp)
        self._complaint = objection or (str(faults.name).lower() if faults else "")
        x, y = frame.tilt_difference_counts
        return Imu(
            stamp.stamp_ns,
            self.vehicle,
            stamp.tick,
            stamp.elapsed_ticks or 0,
            frame.sample_count * TICK_S,
            stamp.stamp_sigma_s,
            rate_rad_s(frame.gyro_counts),
            (specific_force_m_s2(x), specific_force_m_s2(y)),
            self._temperature_c(),
            not self._complaint,
            self._complaint,
            self._parser.counters.frames_lost,
            0 if objection else int(usable_readings(faults)),
        )

    def _objection(self, stamp: TickStamp) -> str:
        """Why samples of this stream cannot be used, whatever they say; empty if they can."""
        if self._found_number is not None and self._serial_number not in (None, self._found_number):
            return f"this is block {self._found_number}, the rig wants {self._serial_number}"
        if stamp.stamp_sigma_s > WORST_STAMP_S:
            return f"frames do not come at the rate of averaging = {self._averaging}"
        return ""

    def _temperature_c(self) -> float:
        """Mean of the chips that have spoken; before that, and with version 1, what the rig states."""
        seen = self._environment
        chips = (seen.temperature_gyro_c, seen.temperature_tilt_x_c, seen.temperature_tilt_y_c)
        known = [value for value in chips if not math.isnan(value)]
        return sum(known) / len(known) if known else self._given_temperature_c
