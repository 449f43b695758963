"""Sample frame and replies of v2: COBS packets with CRC-16, 1 kHz tick, all four tilt channels.

::

    2h | tick u16 | count u8 | gyro u16 /16 | tilts 4 x u16 /16 | housekeeping u16 | CRC u16

``2h`` is 0010 a0ii: ``a`` attention, ``ii`` the housekeeping item. 18 bytes, 21 on the wire.
"""

import struct
from collections import deque
from collections.abc import Iterable

from drivers.imu_block.block_frames import (
    FIXED_POINT,
    GYRO_CODE_MAX,
    TILT_CODE_MAX,
    Ack,
    Housekeeping,
    HousekeepingItem,
    Identity,
    ImuFrame,
    Pong,
    Reply,
)
from drivers.imu_block.counters import ParserCounters
from drivers.imu_block.frame_v1 import to_fixed
from drivers.imu_block.packet import PacketSplitter, seal, unseal

V2_WIRE_BYTES = 21
TYPE_SAMPLE = 0x20
TYPE_ATTENTION = 0x08
TYPE_PONG = 0x30
TYPE_ACK = 0x31
TYPE_IDENTITY = 0x32

_SAMPLE = struct.Struct(">BHBHHHHHH")
_SAMPLE_PACKET = struct.Struct(">BHBHHHHHHH")
_SAMPLE_TYPES = frozenset(TYPE_SAMPLE | a | i for a in (0, TYPE_ATTENTION) for i in range(4))
_PONG = struct.Struct(">BBH")
_ACK = struct.Struct(">BBBB")
_IDENTITY = struct.Struct(">BBBBBIB")
_CRC_BYTES = 2
_PACKET_SIZES = frozenset(s.size + _CRC_BYTES for s in (_SAMPLE, _PONG, _ACK, _IDENTITY))
_ENCODED_SIZES = frozenset(size + 1 for size in _PACKET_SIZES)
_GYRO_FIXED_MAX = GYRO_CODE_MAX * FIXED_POINT
_TILT_FIXED_MAX = TILT_CODE_MAX * FIXED_POINT
_ITEMS = tuple(HousekeepingItem)
_LOSS_LIMIT_TICKS = 5000
"""A tick jump beyond 5 s is taken for a restart of the block, unless the bytes of lost frames came."""
_FIRST_WINDOWS = 4
"""A tick of one of these, without the bytes of what is missing, is a restart, unless few are missing."""
_SMALL_GAP = 16
_TICK_MODULUS = 65536
REPEATS_KNOWN = 8
"""Of the last so many packets, one that comes again is known."""
_HIGHEST_CODE = {
    HousekeepingItem.TEMPERATURE_GYRO: GYRO_CODE_MAX,
    HousekeepingItem.TEMPERATURE_TILT_X: 0xFF,
    HousekeepingItem.TEMPERATURE_TILT_Y: 0xFF,
    HousekeepingItem.STATUS: 0xFFFF,
}


def encode_v2(
    *,
    tick_ms: int,
    sample_count: int,
    gyro_counts: float,
    tilt_counts: Iterable[float],
    housekeeping: Housekeeping | tuple[int, int],
    attention: bool = False,
) -> bytes:
    """Build one v2 sample frame (21 bytes on the wire, delimiters included).

    Args:
        tick_ms: 1 kHz tick of the window's last poll, taken modulo 65536.
        sample_count: polls averaged, 1..255.
        gyro_counts: mean gyro code, 0..4095.
        tilt_counts: mean codes x.X, x.Y, y.X, y.Y, each 0..2047.
        housekeeping: (item 0..3, value 0..65535).
        attention: whether a fault or self-test bit is set in the status word.

    Raises:
        ValueError: if a value is out of range.
    """
    item, value = housekeeping
    if not 1 <= sample_count <= 255 or not 0 <= item <= 3 or not 0 <= value <= 0xFFFF:
        raise ValueError(f"sample count {sample_count} or housekeeping {item}, {value} is out of range")
    kind = TYPE_SAMPLE | item | (TYPE_ATTENTION if attention else 0)
    gyro = to_fixed(gyro_counts, 0, GYRO_CODE_MAX, "gyro")
    tilts = [to_fixed(counts, 0, TILT_CODE_MAX, "tilt channel") for counts in tilt_counts]
    return seal(_SAMPLE.pack(kind, tick_ms & 0xFFFF, sample_count, gyro, *tilts, value))


def encode_reply(reply: Reply) -> bytes:
    """Build the wire bytes of a reply (9 to 15 bytes).

    Raises:
        ValueError: if a field does not fit its place.
    """
    try:
        match reply:
            case Pong(tag, tick_ms):
                return seal(_PONG.pack(TYPE_PONG, tag, tick_ms & 0xFFFF))
            case Ack(tag, command, result):
                return seal(_ACK.pack(TYPE_ACK, tag, command, result))
            case Identity(tag, protocol, major, minor, serial_number, sample_count):
                return seal(
                    _IDENTITY.pack(TYPE_IDENTITY, tag, protocol, major, minor, serial_number, sample_count)
                )
    except struct.error as error:
        raise ValueError(f"{reply} does not fit the wire format: {error}") from None


class V2Parser:
    """Cuts v2 frames and replies out of a byte stream that may start or break anywhere.

    Args:
        counters: where to count; shared with the owner.
    """

    def __init__(self, counters: ParserCounters) -> None:
        self.counters = counters
        self.lock_end_offset: int | None = None
        """Index, in the last chunk, of the last byte of its first good packet."""
        self._splitter = PacketSplitter(counters)
        self._last_tick: int | None = None
        self._is_locked = False
        self._recent: deque[bytes] = deque(maxlen=REPEATS_KNOWN)
        self._bytes_before = 0  # in the chunks since the last sample, up to the present one
        self._last_end = -1  # of that sample, in the present chunk

    def begun_again(self, counters: ParserCounters) -> "V2Parser":
        """A parser that knows nothing of the stream but what the last sample of this one was."""
        parser = V2Parser(counters)
        parser._last_tick = self._last_tick
        parser._bytes_before = self._bytes_before
        return parser

    def adopt(self, counters: ParserCounters) -> None:
        """Count into ``counters`` from now on."""
        self.counters = counters
        self._splitter.counters = counters

    def feed(self, chunk: bytes) -> list[ImuFrame | Reply]:
        """Return every frame and reply that the stream so far completes, in order."""
        results: list[ImuFrame | Reply] = []
        self.lock_end_offset = None
        for end, encoded in self._splitter.feed(chunk):
            if len(encoded) not in _ENCODED_SIZES:
                self.counters.rejected_length += 1
                self.counters.bytes_rejected += len(encoded)
                continue
            packet = unseal(encoded, self.counters)
            if packet is None:
                continue
            result = self._sample(packet, end) if packet[0] in _SAMPLE_TYPES else self._reply(packet)
            if result is None:
                self.counters.bytes_rejected += len(encoded)
                continue
            if self.lock_end_offset is None:
                self.lock_end_offset = end
            results.append(result)
        self._bytes_before += len(chunk) - 1 - self._last_end
        self._last_end = -1
        return results

    def _sample(self, packet: bytes, end: int) -> ImuFrame | None:
        counters = self.counters
        if len(packet) != _SAMPLE_PACKET.size:
            counters.rejected_length += 1
            return None
        kind, tick, count, gyro, xx, xy, yx, yy, value, _ = _SAMPLE_PACKET.unpack(packet)
        if not count or gyro > _GYRO_FIXED_MAX or max(xx, xy, yx, yy) > _TILT_FIXED_MAX:
            counters.rejected_implausible += 1
            return None
        if packet in self._recent:  # something on the way has sent it twice
            counters.rejected_sequence += 1
            return None
        self._recent.append(packet)
        if not self._is_locked:
            self._is_locked = True
            counters.locks += 1
        if self._last_tick is not None:
            self._account(tick, count, self._bytes_before + end - self._last_end)
        self._last_tick, self._bytes_before, self._last_end = tick, 0, end
        counters.frames_good += 1
        item = _ITEMS[kind & 3]
        is_possible = value <= _HIGHEST_CODE[item]
        counters.rejected_implausible += not is_possible
        return ImuFrame(
            2,
            None,
            tick,
            count,
            gyro / FIXED_POINT,
            (xx / FIXED_POINT, xy / FIXED_POINT, yx / FIXED_POINT, yy / FIXED_POINT),
            ((xx - xy) / FIXED_POINT, (yx - yy) / FIXED_POINT),
            Housekeeping(item, value) if is_possible else None,
            bool(kind & TYPE_ATTENTION),
            end,
        )

    def _account(self, tick: int, count: int, passed_bytes: int) -> None:
        """Count what is missing between the last frame and this one; bytes tell where ticks are ambiguous."""
        assert self._last_tick is not None
        elapsed = (tick - self._last_tick) % _TICK_MODULUS
        if elapsed == count and passed_bytes < _TICK_MODULUS:
            return
        passed = passed_bytes / V2_WIRE_BYTES * count
        elapsed += _TICK_MODULUS * max(0, round((passed - elapsed) / _TICK_MODULUS))
        if passed < elapsed / 2:
            is_first = tick <= _FIRST_WINDOWS * count and elapsed > _SMALL_GAP * count
            if is_first or not 0 < elapsed <= _LOSS_LIMIT_TICKS:
                self.counters.discontinuities += 1
                return
        if elapsed > count:
            self.counters.frames_lost += max(1, round((elapsed - count) / count))

    def _reply(self, packet: bytes) -> Reply | None:
        kind, size = packet[0], len(packet) - _CRC_BYTES
        reply: Reply
        if kind == TYPE_PONG and size == _PONG.size:
            reply = Pong(*_PONG.unpack_from(packet)[1:])
        elif kind == TYPE_ACK and size == _ACK.size:
            reply = Ack(*_ACK.unpack_from(packet)[1:])
        elif kind == TYPE_IDENTITY and size == _IDENTITY.size:
            reply = Identity(*_IDENTITY.unpack_from(packet)[1:])
        else:
            self.counters.rejected_type += 1
            return None
        self.counters.replies_good += 1
        return reply
