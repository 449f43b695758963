"""Build the byte vectors of the IMU block from its interface document alone.

An independent second implementation, bit by bit and on purpose slow: it imports nothing of the drivers, so
that vectors and codec can disagree. Run it from the top of the project::

    python tools/make_imu_vectors.py tests/vectors

The section numbers are those of ``docs/interfaces/imu_block.md``.
"""

import argparse
import json
from pathlib import Path
from typing import Any


def crc16(data: bytes) -> int:
    """CRC of section 5.2, one bit at a time."""
    register = 0xFFFF
    for byte in data:
        for bit in range(7, -1, -1):
            top = (register >> 15) ^ (byte >> bit & 1)
            register = (register << 1) & 0xFFFF
            if top:
                register ^= 0x1021
    return register


def stuff(packet: bytes) -> bytes:
    """COBS of section 5.3 by counting: each zero becomes the distance to the next one."""
    out: list[int] = []
    for position in range(-1, len(packet)):
        if position >= 0 and packet[position] != 0:
            out.append(packet[position])
            continue
        distance = 1
        while position + distance < len(packet) and packet[position + distance] != 0:
            distance += 1
        out.append(distance)
    return bytes(out)


def big_endian(value: int, size: int) -> bytes:
    """Return a number, two's complement if negative, high byte first."""
    return bytes((value >> 8 * (size - 1 - i)) & 0xFF for i in range(size))


def wire(content: bytes) -> bytes:
    """Envelope of section 5.1."""
    packet = content + big_endian(crc16(content), 2)
    return b"\x00" + stuff(packet) + b"\x00"


def v1_frame(sequence: int, gyro: float, x: float, y: float) -> bytes:
    """Frame of section 4."""
    body = b"\xa5" + big_endian(sequence, 1)
    for value in (gyro, x, y):
        body += big_endian(int(value * 16), 2)
    return body + bytes((sum(body) % 256,))


def v2_frame(
    tick: int, count: int, gyro: float, tilts: list[float], item: int, value: int, attention: int
) -> bytes:
    """Sample frame of section 6."""
    content = bytes((0x20 + 8 * attention + item,)) + big_endian(tick, 2) + bytes((count,))
    content += big_endian(int(gyro * 16), 2)
    for tilt in tilts:
        content += big_endian(int(tilt * 16), 2)
    return wire(content + big_endian(value, 2))


V1_CASES: list[tuple[str, tuple[int, float, float, float]]] = [
    ("at rest, level", (1, 2048.0, 0.0, 0.0)),
    ("turning, pushed", (0x2A, 2089.0625, -12.5, 3.1875)),
    ("payload looks like sync bytes", (0xA5, 2650.3125, -1446.6875, 1.3125)),
    ("gyro at the upper stop, tilts at opposite ends", (255, 4095.0, 2047.0, -2047.0)),
    ("all zero", (0, 0.0, 0.0, 0.0)),
]
V2_CASES: list[tuple[str, tuple[int, int, float, list[float], int, int, int]]] = [
    ("at rest, gyro chip at 25 degC", (16, 4, 2048.0, [1024.0, 1024.0, 1024.0, 1024.0], 0, 2048, 0)),
    ("turning, pushed", (20, 4, 2089.0625, [1017.75, 1030.25, 1025.5, 1022.3125], 1, 170, 0)),
    ("tick wraps, full of zero bytes", (0, 1, 0.0, [0.0, 0.0, 0.0, 0.0], 0, 0, 0)),
    ("all bits set where they may be", (0xFEFF, 255, 4095.0, [2047.0] * 4, 3, 0xFFFF, 1)),
    ("watchdog reset, gyro fault", (12, 4, 4095.0, [1024.0, 1024.0, 1024.0, 1024.0], 3, 0x0114, 1)),
]
PACKET_CASES: list[tuple[str, str, dict[str, int], bytes]] = [
    ("ping", "host", {"tag": 1}, bytes((0x40, 1))),
    ("identify", "host", {"tag": 2}, bytes((0x41, 2))),
    ("set_averaging", "host", {"tag": 3, "sample_count": 4}, bytes((0x42, 3, 4))),
    ("self_test", "host", {"tag": 4, "channels": 5, "duration_ms": 500}, bytes((0x43, 4, 5, 1, 0xF4))),
    ("reset", "host", {"tag": 0}, bytes((0x44, 0, 0x52, 0x54))),
    ("pong", "block", {"tag": 1, "tick_ms": 513}, bytes((0x30, 1, 2, 1))),
    ("ack", "block", {"tag": 3, "command": 0x42, "result": 0}, bytes((0x31, 3, 0x42, 0))),
    (
        "identity",
        "block",
        {
            "tag": 2, "protocol_version": 2, "firmware_major": 1, "firmware_minor": 0,
            "serial_number": 0x0012D687, "sample_count": 4,
        },
        bytes((0x32, 2, 2, 1, 0, 0x00, 0x12, 0xD6, 0x87, 4)),
    ),
]  # fmt: skip


def v1_vectors() -> list[dict[str, Any]]:
    """Return the v1 cases with their bytes."""
    return [
        {
            "name": name, "sequence": s, "gyro_counts": g, "tilt_difference_counts": [x, y],
            "hex": v1_frame(s, g, x, y).hex(" "),
        }
        for name, (s, g, x, y) in V1_CASES
    ]  # fmt: skip


def v2_vectors() -> list[dict[str, Any]]:
    """Return the v2 sample cases with their bytes."""
    return [
        {
            "name": name, "tick_ms": c[0], "sample_count": c[1], "gyro_counts": c[2], "tilt_counts": c[3],
            "housekeeping": [c[4], c[5]], "attention": bool(c[6]), "hex": v2_frame(*c).hex(" "),
        }
        for name, c in V2_CASES
    ]  # fmt: skip


def packet_vectors() -> list[dict[str, Any]]:
    """Return commands and replies with their bytes."""
    return [
        {"name": name, "from": side, "fields": fields, "hex": wire(content).hex(" ")}
        for name, side, fields, content in PACKET_CASES
    ]


def main() -> None:
    """Write the three files and print their lines."""
    arguments = argparse.ArgumentParser(description="Write the byte vectors of the IMU block.")
    arguments.add_argument("folder", type=Path)
    folder = arguments.parse_args().folder
    assert crc16(b"123456789") == 0x29B1
    made = {"imu_v1.json": v1_vectors(), "imu_v2.json": v2_vectors(), "imu_packets.json": packet_vectors()}
    for name, vectors in made.items():
        (folder / name).write_text(json.dumps(vectors, indent=1) + "\n")
        for vector in vectors:
            print(f"{name}: {vector['name']}: {vector['hex']}")


if __name__ == "__main__":
    main()
