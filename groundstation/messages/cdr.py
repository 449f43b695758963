"""CDR codec of the payloads: little-endian XCDR1 with the 4-byte encapsulation header of ROS 2.

Layouts are compiled once per class: runs of fixed-size fields become one ``struct.Struct``, with the
padding of the alignment written into its format. Alignment depends on where a run begins, and that
depends on the strings before it, so runs are compiled per start offset modulo 8 and kept.

Source: OMG DDS-XTypes 1.3, section 7.4.1 (plain CDR); ROS 2 uses it with representation id 0x0001.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Annotated, Any, Generic, TypeVar, get_args, get_origin

import numpy as np

from groundstation.messages.base import Message

ENCAPSULATION = b"\x00\x01\x00\x00"
_NS = 1_000_000_000
_MAX_PADDING = 3  # DDS may round a serialised payload up to four bytes

_PRIMITIVES = {
    "bool": ("?", 1),
    "uint8": ("B", 1),
    "uint16": ("H", 2),
    "uint32": ("I", 4),
    "uint64": ("Q", 8),
    "int64": ("q", 8),
    "float32": ("f", 4),
    "float64": ("d", 8),
}

M = TypeVar("M", bound=Message)


class CodecError(ValueError):
    """Bytes that are no message of the expected type."""


@dataclass(frozen=True, slots=True)
class _Field:
    name: str
    base: str  # ROS primitive or "string"
    count: int  # 1 scalar, n fixed array, 0 sequence


def ros_fields(cls: type[Message]) -> list[tuple[str, str]]:
    """Name and ROS 2 type of each field after the header, e.g. ``("covariance", "float64[9]")``."""
    own = [f for f in fields(cls) if f.name not in {"stamp_ns", "vehicle"}]
    return [(f.name, _ros_type(f.type)) for f in own]


def _ros_type(annotation: object) -> str:
    if get_origin(annotation) is Annotated:
        return str(get_args(annotation)[1])
    raise TypeError(f"{annotation!r} names no ROS type")


def _parse(name: str, ros_type: str) -> _Field:
    base, bracket, rest = ros_type.partition("[")
    count = 1 if not bracket else int(rest[:-1] or 0)
    return _Field(name, base, count)


class _Run:
    """Consecutive fixed-size fields, compiled per start alignment."""

    def __init__(self, run: list[_Field]) -> None:
        self.run = run
        self.scalars = all(f.count == 1 for f in run)
        self._structs: dict[int, struct.Struct] = {}

    def at(self, offset: int) -> struct.Struct:
        compiled = self._structs.get(offset & 7)
        if compiled is None:
            position, layout = offset & 7, "<"
            for field in self.run:
                code, size = _PRIMITIVES[field.base]
                pad = -position % size
                layout += "x" * pad + code * field.count
                position += pad + size * field.count
            compiled = self._structs[offset & 7] = struct.Struct(layout)
        return compiled


class Codec(Generic[M]):
    """Encodes and decodes one class of payload.

    Args:
        cls: The payload's class, annotated with ROS 2 types.
    """

    def __init__(self, cls: type[M]) -> None:
        self._cls = cls
        self._build: Callable[..., M] = cls
        plan: list[_Run | _Field] = []
        for name, ros_type in ros_fields(cls):
            field = _parse(name, ros_type)
            if field.base == "string" or field.count == 0:
                plan.append(field)
            elif plan and isinstance(plan[-1], _Run):
                plan[-1].run.append(field)
            else:
                plan.append(_Run([field]))
        self._plan = tuple(_Run(p.run) if isinstance(p, _Run) else p for p in plan)
        self._headers: dict[str, tuple[struct.Struct, bytes]] = {}

    def encode(self, message: M) -> bytes:
        """Serialise a payload, encapsulation header included."""
        header = self._headers.get(message.vehicle)
        if header is None:
            name = message.vehicle.encode() + b"\0"
            header = self._headers[message.vehicle] = (struct.Struct(f"<4xiII{len(name)}s"), name)
        layout, name = header
        seconds, nanoseconds = divmod(message.stamp_ns, _NS)
        out = bytearray(layout.pack(seconds, nanoseconds, len(name), name))
        out[:4] = ENCAPSULATION
        for part in self._plan:
            if isinstance(part, _Run):
                values: list[Any] = []
                for field in part.run:
                    value = getattr(message, field.name)
                    if field.count == 1:
                        values.append(value)
                    else:
                        values.extend(value)
                out += part.at(len(out) - 4).pack(*values)
            else:
                _put(out, part, getattr(message, part.name))
        return bytes(out)

    def decode(self, data: bytes) -> M:
        """Read a payload back.

        Raises:
            CodecError: The bytes are cut off or are no little-endian CDR.
        """
        if data[:4] != ENCAPSULATION:
            raise CodecError(f"{self._cls.__name__}: expected little-endian CDR, found {data[:4].hex()}")
        try:
            seconds, nanoseconds, length = struct.unpack_from("<iII", data, 4)
            position = 16 + length
            values: list[Any] = [seconds * _NS + nanoseconds, data[16 : position - 1].decode()]
            for part in self._plan:
                if isinstance(part, _Run):
                    layout = part.at(position - 4)
                    found = layout.unpack_from(data, position)
                    position += layout.size
                    if part.scalars:
                        values.extend(found)
                    else:
                        start = 0
                        for field in part.run:
                            stop = start + field.count
                            values.append(found[start] if field.count == 1 else found[start:stop])
                            start = stop
                else:
                    value, position = _take(data, position, part)
                    values.append(value)
        except (struct.error, ValueError) as error:
            raise CodecError(f"{self._cls.__name__}: {len(data)} bytes do not fit the layout") from error
        if position > len(data):
            raise CodecError(f"{self._cls.__name__}: cut off after {len(data)} bytes")
        if len(data) - position > _MAX_PADDING:
            raise CodecError(f"{self._cls.__name__}: {len(data) - position} bytes too many")
        return self._build(*values)


def _pad(out: bytearray, size: int) -> None:
    out += bytes(-(len(out) - 4) % size)


def _put_string(out: bytearray, text: str) -> None:
    raw = text.encode() + b"\0"
    _pad(out, 4)
    out += len(raw).to_bytes(4, "little") + raw


def _put(out: bytearray, field: _Field, value: Any) -> None:  # noqa: ANN401 a field holds any ROS type
    if field.base == "string":
        if field.count == 1:
            _put_string(out, value)
            return
        _pad(out, 4)
        out += len(value).to_bytes(4, "little")
        for text in value:
            _put_string(out, text)
        return
    _pad(out, 4)
    out += len(value).to_bytes(4, "little")
    code, size = _PRIMITIVES[field.base]
    if len(value):
        _pad(out, size)
    if isinstance(value, np.ndarray):
        if value.dtype.char != code:  # hearers in memory would see other numbers than those of a recording
            raise TypeError(f"{field.name}: expected {field.base}, found {value.dtype}")
        out += value.astype(value.dtype.newbyteorder("<"), copy=False).tobytes()
    elif isinstance(value, bytes):
        out += value
    else:
        out += struct.pack(f"<{len(value)}{code}", *value)


def _take_string(data: bytes, position: int) -> tuple[str, int]:
    position += -(position - 4) % 4
    (length,) = struct.unpack_from("<I", data, position)
    position += 4
    raw = data[position : position + length]
    if len(raw) != length or not raw.endswith(b"\0"):
        raise ValueError("string is cut off")
    return raw[:-1].decode(), position + length


def _take(data: bytes, position: int, field: _Field) -> tuple[Any, int]:
    if field.base == "string" and field.count == 1:
        return _take_string(data, position)
    position += -(position - 4) % 4
    (length,) = struct.unpack_from("<I", data, position)
    position += 4
    if field.base == "string":
        texts = []
        for _ in range(length):
            text, position = _take_string(data, position)
            texts.append(text)
        return tuple(texts), position
    code, size = _PRIMITIVES[field.base]
    if length:
        position += -(position - 4) % size
    stop = position + length * size
    if stop > len(data):
        raise ValueError("sequence is cut off")
    if field.base == "uint8":
        return data[position:stop], stop
    if field.base == "float32":
        return np.frombuffer(data, dtype=np.float32, count=length, offset=position), stop
    return struct.unpack_from(f"<{length}{code}", data, position), stop
