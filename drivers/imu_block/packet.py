"""Envelope of everything in v2, both directions: COBS packet with CRC between two delimiters.

::

    00 | COBS( type u8, fields, CRC-16 u16 ) | 00        all numbers big endian

CRC: polynomial 0x1021, start 0xFFFF, no reflection, no final inversion ("CRC-16/CCITT-FALSE", check value
of ``123456789`` is 0x29B1), over type and fields. High byte first, so that the
CRC of the whole packet is zero.
Delimiters on both sides: one corrupted byte, delimiters included, costs at most one packet.
"""

from binascii import crc_hqx

from drivers.imu_block import cobs
from drivers.imu_block.counters import ParserCounters

CRC_START = 0xFFFF
MAX_ENCODED_BYTES = 20
"""Longest packet between delimiters: 22 bytes on the wire."""


def seal(content: bytes) -> bytes:
    """Return ``content`` (type and fields) as wire bytes with CRC, stuffing and both delimiters."""
    packet = content + crc_hqx(content, CRC_START).to_bytes(2, "big")
    return b"\x00" + cobs.encode(packet) + b"\x00"


def unseal(encoded: bytes, counters: ParserCounters) -> bytes | None:
    """Return type, fields and CRC of the bytes between two delimiters, or None with the reason counted."""
    packet = cobs.decode(encoded)
    if packet is None:
        counters.rejected_cobs += 1
    elif crc_hqx(packet, CRC_START):
        counters.rejected_crc += 1
    else:
        return packet
    counters.bytes_rejected += len(encoded)
    return None


class PacketSplitter:
    """Cuts a byte stream at its delimiters; over-long runs are dropped and counted.

    Args:
        counters: where to count; shared with the owner.
    """

    def __init__(self, counters: ParserCounters) -> None:
        self.counters = counters
        self._tail = b""
        self._is_overlong = False

    def feed(self, chunk: bytes) -> list[tuple[int, bytes]]:
        """Return (index in ``chunk`` of the closing delimiter, encoded packet) for each completed run."""
        tail = self._tail
        parts = chunk.split(b"\x00")
        last = parts.pop()
        packets: list[tuple[int, bytes]] = []
        end = -1
        for part in parts:
            end += len(part) + 1
            if tail:
                part = tail + part
                tail = b""
            if not part and not self._is_overlong:
                continue
            if self._is_overlong or len(part) > MAX_ENCODED_BYTES:
                self.counters.rejected_length += 1
                self.counters.bytes_rejected += len(part)
                self._is_overlong = False
                continue
            packets.append((end, part))
        tail += last
        if len(tail) > MAX_ENCODED_BYTES:
            self.counters.bytes_rejected += len(tail)
            tail = b""
            self._is_overlong = True
        self._tail = tail
        return packets
