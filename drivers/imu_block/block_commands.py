"""Commands from host to block: how they are built, and the block's side that reads them."""

import struct
from dataclasses import dataclass
from enum import IntFlag

from drivers.imu_block.counters import ParserCounters
from drivers.imu_block.packet import PacketSplitter, seal, unseal

TYPE_PING = 0x40
TYPE_IDENTIFY = 0x41
TYPE_SET_AVERAGING = 0x42
TYPE_SELF_TEST = 0x43
TYPE_RESET = 0x44
RESET_KEY = 0x5254
"""Second field of a reset, the letters RT: no single-field mistake restarts a flying block."""

SAMPLE_COUNT_MAX = 100
SELF_TEST_MAX_MS = 2000

_PING = struct.Struct(">BB")
_SET_AVERAGING = struct.Struct(">BBB")
_SELF_TEST = struct.Struct(">BBBH")
_RESET = struct.Struct(">BBH")


class SelfTestChannel(IntFlag):
    """What a self-test deflects; 0 ends a running one."""

    GYRO_NEGATIVE = 0x01
    GYRO_POSITIVE = 0x02
    TILT_X_X = 0x04
    TILT_X_Y = 0x08
    TILT_Y_X = 0x10
    TILT_Y_Y = 0x20


@dataclass(frozen=True, slots=True)
class Ping:
    """Asks for a pong with the block's tick."""

    tag: int


@dataclass(frozen=True, slots=True)
class Identify:
    """Asks for firmware version and serial number."""

    tag: int


@dataclass(frozen=True, slots=True)
class SetAveraging:
    """Sets the number of polls per frame; valid from the next window on."""

    tag: int
    sample_count: int


@dataclass(frozen=True, slots=True)
class SelfTest:
    """Deflects sensing elements for a time that the block itself ends."""

    tag: int
    channels: int
    duration_ms: int


@dataclass(frozen=True, slots=True)
class Reset:
    """Restarts the block as its watchdog would."""

    tag: int


@dataclass(frozen=True, slots=True)
class BadCommand:
    """A command with a good CRC that cannot be obeyed; the block answers an ack with ``result``."""

    tag: int
    command: int
    result: int


Command = Ping | Identify | SetAveraging | SelfTest | Reset | BadCommand


def encode_ping(tag: int) -> bytes:
    """Build a ping; the pong repeats ``tag`` (0..255)."""
    return seal(_PING.pack(TYPE_PING, _byte(tag, "tag")))


def encode_identify(tag: int) -> bytes:
    """Build an identify request; the answer repeats ``tag`` (0..255)."""
    return seal(_PING.pack(TYPE_IDENTIFY, _byte(tag, "tag")))


def encode_set_averaging(tag: int, sample_count: int) -> bytes:
    """Build a set-averaging command for 1..100 polls per frame (1000/N frames/s).

    Raises:
        ValueError: if the count is out of range.
    """
    if not 1 <= sample_count <= SAMPLE_COUNT_MAX:
        raise ValueError(f"averaging over {sample_count} polls, expected 1 to {SAMPLE_COUNT_MAX}")
    return seal(_SET_AVERAGING.pack(TYPE_SET_AVERAGING, _byte(tag, "tag"), sample_count))


def encode_self_test(tag: int, channels: SelfTestChannel | int, duration_ms: int) -> bytes:
    """Build a self-test command for the given channels; 0 channels end a running test.

    Raises:
        ValueError: if channels are unknown or the duration is not 0..2000 ms.
    """
    if not 0 <= channels <= 0x3F or not 0 <= duration_ms <= SELF_TEST_MAX_MS:
        raise ValueError(f"self-test of channels {channels:#x} for {duration_ms} ms is out of range")
    return seal(_SELF_TEST.pack(TYPE_SELF_TEST, _byte(tag, "tag"), channels, duration_ms))


def encode_reset(tag: int) -> bytes:
    """Build a reset command."""
    return seal(_RESET.pack(TYPE_RESET, _byte(tag, "tag"), RESET_KEY))


def _byte(value: int, what: str) -> int:
    if not 0 <= value <= 0xFF:
        raise ValueError(f"{what} is {value}, expected 0 to 255")
    return value


class CommandParser:
    """The block's side: commands out of a byte stream that may start or break anywhere."""

    def __init__(self) -> None:
        self.counters = ParserCounters()
        self._splitter = PacketSplitter(self.counters)

    def feed(self, chunk: bytes) -> list[Command]:
        """Return every command that the stream so far completes, in order."""
        self.counters.bytes_seen += len(chunk)
        commands: list[Command] = []
        for _, encoded in self._splitter.feed(chunk):
            packet = unseal(encoded, self.counters)
            if packet is None:
                continue
            if len(packet) < 4:  # type, tag, CRC
                self.counters.rejected_length += 1
                self.counters.bytes_rejected += len(encoded)
                continue
            commands.append(_command(packet[:-2]))
        return commands


def _command(content: bytes) -> Command:
    """Return what type, tag and fields ask for."""
    kind, tag = content[0], content[1]
    match kind:
        case 0x40 if len(content) == _PING.size:
            return Ping(tag)
        case 0x41 if len(content) == _PING.size:
            return Identify(tag)
        case 0x42 if len(content) == _SET_AVERAGING.size:
            if 1 <= content[2] <= SAMPLE_COUNT_MAX:
                return SetAveraging(tag, content[2])
        case 0x43 if len(content) == _SELF_TEST.size:
            _, _, channels, duration_ms = _SELF_TEST.unpack(content)
            if channels <= 0x3F and duration_ms <= SELF_TEST_MAX_MS:
                return SelfTest(tag, channels, duration_ms)
        case 0x44 if len(content) == _RESET.size:
            if _RESET.unpack(content)[2] == RESET_KEY:
                return Reset(tag)
    is_known = TYPE_PING <= kind <= TYPE_RESET
    return BadCommand(tag, kind, result=2 if is_known else 1)
