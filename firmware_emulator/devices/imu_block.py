"""The IMU block: a PIC16F876A that polls its sensors at 1 kHz, averages, sends frames, obeys commands.

Power-up as on the real thing: a garbage byte while the transmitter's pin comes up, 35 ms for the gyro to
start, then frames with the sequence from 1 and the tick from 0. A reset does the same again.
"""

from collections import deque

import numpy as np

from drivers.imu_block.protocol import (
    V1_WIRE_BYTES,
    V2_WIRE_BYTES,
    Ack,
    AckResult,
    BadCommand,
    Command,
    CommandParser,
    Identify,
    Identity,
    Ping,
    Pong,
    Reply,
    Reset,
    SelfTest,
    SelfTestChannel,
    SetAveraging,
    Status,
    encode_reply,
    encode_v1,
    encode_v2,
)
from firmware_emulator.devices.ailments import Ailments
from firmware_emulator.devices.imu_sensors import Disturbances, ImuSensors
from firmware_emulator.devices.sensor_errors import WarmUp
from firmware_emulator.devices.serial_line import PACKET_BYTES, SerialLine
from firmware_emulator.failures import Failures
from firmware_emulator.plant.motion_state import PollGrid
from firmware_emulator.plant.rigid_body import Vehicle

GYRO_START_NS = 35_000_000  # ADIS16100 data sheet
FRAME_DELAY_NS = 500_000  # from the tick's edge to the first start bit: 0.39 ms of SPI, then arithmetic
TRANSMITTER_UP_NS = 1_000_000
GARBAGE = b"\xf8"  # a rising pin read as a start bit
FIRMWARE = (1, 0)
_GYRO_TEMPERATURE_PER_K = 1.0 / 0.1453  # ADIS16100: 0.1453 deg C per LSB, 2048 at 25 deg C
_HOUSEKEEPING_ITEMS = 4
_COMMAND_TYPE = {SetAveraging: 0x42, SelfTest: 0x43, Reset: 0x44}  # docs/interfaces/imu_block.md


class ImuBlock:
    """Firmware and sensors on one serial line.

    Args:
        vehicle: Whose motion it feels.
        grid: The crystal's polls, the same that the vehicle was given; starts `GYRO_START_NS` after power-up.
        sensors: Gyro and inclinometers.
        line: To the host.
        frame_version: 1 or 2. A version 1 block receives no commands.
        averaging: Polls per frame.
        serial_number: For identify.
        warm_up: Its temperature.
        failures: Those of an IMU block (`Ailments`).
        rng: For the noise of temperature readings.
        start_ns: Power-up.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        grid: PollGrid,
        sensors: ImuSensors,
        line: SerialLine,
        frame_version: int,
        averaging: int,
        serial_number: int,
        warm_up: WarmUp,
        failures: Failures,
        rng: np.random.Generator,
        start_ns: int = 0,
    ) -> None:
        self.line = line
        self._vehicle, self._grid, self._sensors = vehicle, grid, sensors
        self._version, self._own_averaging = frame_version, averaging
        self._averaging = self._window = averaging
        self._serial_number = serial_number
        self._warm_up, self._rng = warm_up, rng
        self._ailments = Ailments(failures)
        self._start_ns = start_ns
        self._inbox: deque[tuple[int, bytes]] = deque()
        self._commands = CommandParser()
        self._refused = 0
        self._boot_poll = 0
        self._window_end = averaging
        self._frames = 0
        self._reset_cause = Status.RESET_POWER_ON
        self._frame_ns = grid.stamp_ns(averaging)
        line.send(start_ns + TRANSMITTER_UP_NS, GARBAGE)

    @property
    def next_ns(self) -> int:
        """Moment of the next thing it does."""
        return min(self._frame_ns, self._inbox[0][0]) if self._inbox else self._frame_ns

    @property
    def next_output_ns(self) -> int:
        """Earliest stamp at which bytes may reach the host."""
        first_send_ns = self._frame_ns + FRAME_DELAY_NS
        if self._inbox:
            return self.line.next_arrival_ns(min(first_send_ns, self._inbox[0][0]), PACKET_BYTES, 0)
        wire_bytes = V1_WIRE_BYTES if self._version == 1 else V2_WIRE_BYTES
        period_ns = int(min(self._window, self._averaging) * self._grid.period_ns)
        return self.line.next_arrival_ns(first_send_ns, wire_bytes, period_ns)

    def take(self, until_ns: int) -> list[tuple[int, bytes]]:
        """Chunks of bytes that reached the host up to `until_ns`."""
        return self.line.take(until_ns)

    def receive(self, stamp_ns: int, data: bytes) -> None:
        """Bytes that the host writes at `stamp_ns`; they take their time on the line."""
        arrives_ns = stamp_ns + round(len(data) * self.line.byte_ns)
        if self._inbox:
            arrives_ns = max(arrives_ns, self._inbox[-1][0])
        self._inbox.append((arrives_ns, data))

    def run(self, now_ns: int) -> None:
        """Do what is due at `now_ns`."""
        while self._inbox and self._inbox[0][0] <= now_ns:
            stamp_ns, data = self._inbox.popleft()
            if self._version == 2:
                for command in self._commands.feed(data):
                    self._obey(command, stamp_ns)
        if self._frame_ns <= now_ns:
            self._finish_window()

    def _finish_window(self) -> None:
        stamp_ns = self._frame_ns
        self._vehicle.advance(stamp_ns)
        temperature_c = self._warm_up.at((stamp_ns - self._start_ns) / 1e9)
        disturbances = self._ailments.at(stamp_ns - self._start_ns, self._window_end)
        felt = self._vehicle.take_felt()[-self._window :]  # a block that restarts misses those before
        gyro, tilts = self._sensors.average(felt, temperature_c, disturbances)
        self._ailments.held_gyro_code = round(gyro)
        self._frames += 1
        jumped_ms = self._ailments.jumped_ms(stamp_ns - self._start_ns)
        if self._version == 1:
            frame = encode_v1(
                sequence=self._frames + round(jumped_ms / self._window),
                gyro_counts=gyro,
                tilt_difference_counts=(tilts[0] - tilts[1], tilts[2] - tilts[3]),
            )
        else:
            status = self._status(disturbances, tilts)
            frame = encode_v2(
                tick_ms=self._window_end - self._boot_poll + jumped_ms,
                sample_count=self._window,
                gyro_counts=gyro,
                tilt_counts=tilts,
                housekeeping=self._housekeeping(temperature_c, status),
                attention=bool(status.value & _ATTENTION.value),
            )
        self._send(stamp_ns, frame)
        self._begin_window(self._window_end)

    def _send(self, stamp_ns: int, data: bytes) -> int:
        """Put a frame on the line, unless the block is silent; return when the line is free."""
        if self._ailments.is_silent(stamp_ns - self._start_ns):
            return max(stamp_ns, self.line.free_ns)
        return self.line.send(stamp_ns + FRAME_DELAY_NS, data)

    def _begin_window(self, last_poll: int) -> None:
        self._window = self._averaging
        self._window_end = last_poll + self._window
        self._frame_ns = self._grid.stamp_ns(self._window_end)

    def _status(self, disturbances: Disturbances | None, tilts: tuple[float, ...]) -> Status:
        status = self._reset_cause
        if disturbances is None:
            return status
        if self._ailments.is_testing:
            return status | Status.SELF_TEST
        # The firmware knows a dead chip by its codes alone; a stuck gyro it cannot see.
        if max(tilts[:2]) > _WINDOW_TOP:
            status |= Status.FAULT_TILT_X
        if max(tilts[2:]) > _WINDOW_TOP:
            status |= Status.FAULT_TILT_Y
        return status

    def _housekeeping(self, temperature_c: float, status: Status) -> tuple[int, int]:
        item = (self._window_end - self._boot_poll) // self._window % _HOUSEKEEPING_ITEMS
        if item == _HOUSEKEEPING_ITEMS - 1:
            return item, int(status) | (self._refused & 0xFF) << 8
        if item == 0:
            return item, round(2048 + (temperature_c - 25.0) * _GYRO_TEMPERATURE_PER_K + self._rng.normal())
        return item, round(197.0 - 1.083 * temperature_c)  # SCA103T: T = (counts - 197) / -1.083

    def _obey(self, command: Command, stamp_ns: int) -> None:
        poll = self._grid.last_poll(stamp_ns)
        age_ns = stamp_ns - self._start_ns
        reply: Reply
        match command:
            case Ping(tag):
                reply = Pong(tag, (poll - self._boot_poll + self._ailments.jumped_ms(age_ns)) & 0xFFFF)
            case Identify(tag):
                serial_number = self._ailments.serial_number(self._serial_number, age_ns)
                reply = Identity(tag, self._version, *FIRMWARE, serial_number, self._averaging)
            case BadCommand(tag, kind, result):
                self._refused += 1
                reply = Ack(tag, kind, result)
            case SetAveraging(tag, sample_count) if not self._fits_line(sample_count):
                self._refused += 1
                reply = Ack(tag, _COMMAND_TYPE[SetAveraging], AckResult.BAD_ARGUMENT)
            case SetAveraging(tag, sample_count):
                self._averaging = sample_count  # the window under way keeps its length and its count
                reply = Ack(tag, _COMMAND_TYPE[SetAveraging], AckResult.DONE)
            case SelfTest(tag, channels, duration_ms):
                self._ailments.test(SelfTestChannel(channels), poll + duration_ms)
                reply = Ack(tag, _COMMAND_TYPE[SelfTest], AckResult.DONE)
            case Reset(tag):
                reply = Ack(tag, _COMMAND_TYPE[Reset], AckResult.DONE)
        sent_ns = self._send(stamp_ns, encode_reply(reply))
        if isinstance(command, Reset):
            self._restart(sent_ns)

    def _fits_line(self, sample_count: int) -> bool:
        return V2_WIRE_BYTES * self.line.byte_ns <= sample_count * self._grid.period_ns

    def _restart(self, stamp_ns: int) -> None:
        """Back to the first line of the firmware; polls until the gyro may be trusted are lost."""
        self._boot_poll = self._grid.last_poll(stamp_ns + GYRO_START_NS)
        self._ailments.test(SelfTestChannel(0), 0)
        self._frames, self._refused = 0, 0
        self._averaging = self._own_averaging
        self._reset_cause = Status.RESET_WATCHDOG
        self._commands = CommandParser()
        self.line.send(stamp_ns + TRANSMITTER_UP_NS, GARBAGE)
        self._begin_window(self._boot_poll)


_WINDOW_TOP = 1945  # SCA103T: upper end of the output's normal range, 4.75 V
_ATTENTION = Status.FAULT_GYRO | Status.FAULT_TILT_X | Status.FAULT_TILT_Y | Status.SELF_TEST
