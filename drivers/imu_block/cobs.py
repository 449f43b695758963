"""Consistent overhead byte stuffing for packets shorter than 254 bytes.

Source: S. Cheshire and M. Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Transactions on Networking
7 (2), 1999. Every block of the general code that is shorter than 254 bytes ends in a removed zero, so a short
packet is a chain of pointers from zero to zero: that makes both directions a few byte-string operations.
"""

DELIMITER = b"\x00"
MAX_PACKET_BYTES = 253


def encode(packet: bytes) -> bytes:
    """Return ``packet`` without zero bytes, one byte longer, without delimiters.

    Args:
        packet: 0 to 253 bytes.

    Raises:
        ValueError: if the packet is longer than 253 bytes.
    """
    if len(packet) > MAX_PACKET_BYTES:
        raise ValueError(f"packet has {len(packet)} bytes, at most {MAX_PACKET_BYTES} are allowed")
    return b"".join([bytes((len(part) + 1,)) + part for part in packet.split(DELIMITER)])


def decode(encoded: bytes) -> bytes | None:
    """Return the packet inside ``encoded`` (delimiters removed), or None if the pointer chain is broken.

    Args:
        encoded: bytes between two delimiters; must not contain a zero byte.
    """
    chain = bytearray(encoded)
    size = len(chain)
    position = 0
    while position < size:
        step = chain[position]
        if not step:
            return None
        chain[position] = 0
        position += step
    if position != size or not size:
        return None
    return bytes(chain[1:])
