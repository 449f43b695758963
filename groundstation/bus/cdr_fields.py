"""How the fields of a payload lie in CDR: runs of fixed size, texts, sequences.

Runs become one ``struct.Struct``, with the padding of the alignment written into its format. Alignment counts
from behind the encapsulation header and depends on where a run begins, and that depends on the strings before
it, so runs are compiled per start offset modulo 8 and kept.
"""

import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from itertools import groupby
from operator import attrgetter
from typing import Annotated, Any, get_args, get_origin

import numpy as np

from groundstation.declarations.message import Message

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
_ARRAY_CODES = {"bool": "?", "uint8": "u1", "uint16": "<u2", "uint32": "<u4", "uint64": "<u8", "int64": "<i8"}
_ARRAY_CODES |= {"float32": "<f4", "float64": "<f8"}
_LENGTH = struct.Struct("<I")
_TO_FOUR = (b"", b"\0\0\0", b"\0\0", b"\0")
_SHORT = 64


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
    if base != "string" and base not in _PRIMITIVES:
        raise TypeError(f"{name}: {ros_type!r} is no type that a payload can have")
    count = 1 if not bracket else int(rest[:-1] or 0)
    return _Field(name, base, count)


class Run:
    """Consecutive fixed-size fields, compiled per start alignment.

    Attributes:
        flat: Gives the numbers of a message, arrays laid open.
        gathered: Gives the fields of unpacked numbers, arrays as tuples.
        names: Of the fields.
    """

    def __init__(self, run: Sequence[_Field]) -> None:
        self._run = run
        self.names = tuple(field.name for field in run)
        self._structs: dict[int, struct.Struct] = {}
        self.flat: Callable[[Message], Sequence[Any]] = _compiled(
            "message", ("*" * (field.count > 1) + f"message.{field.name}" for field in run)
        )
        self.gathered: Callable[[Sequence[Any]], Sequence[Any]] = _compiled("found", _slices(run))

    def layout(self, offset: int) -> str:
        """Format of the run behind ``offset`` bytes of content."""
        position, layout = offset & 7, ""
        for field in self._run:
            code, size = _PRIMITIVES[field.base]
            pad = -position % size
            layout += "x" * pad + code * field.count
            position += pad + size * field.count
        return layout

    def dtype(self, offset: int) -> np.dtype[np.void]:
        """The run behind ``offset`` bytes of content, as NumPy reads many of them at once."""
        formats, offsets, position = [], [], offset & 7
        for field in self._run:
            size = _PRIMITIVES[field.base][1]
            position += -position % size
            code = _ARRAY_CODES[field.base]
            formats.append(code if field.count == 1 else f"({field.count},){code}")
            offsets.append(position - (offset & 7))
            position += size * field.count
        return np.dtype(
            {
                "names": list(self.names),
                "formats": formats,
                "offsets": offsets,
                "itemsize": position - (offset & 7),
            }
        )

    def put(self, out: bytearray, message: Message) -> None:
        """Append the fields of a message."""
        out += self._at(len(out)).pack(*self.flat(message))

    def take(self, data: bytes, position: int, values: list[Any]) -> int:
        """Append the fields found at a position; return the position behind them."""
        layout = self._at(position)
        values += self.gathered(layout.unpack_from(data, position))
        return position + layout.size

    def _at(self, position: int) -> struct.Struct:
        offset = (position - 4) & 7
        compiled = self._structs.get(offset)
        if compiled is None:
            compiled = self._structs[offset] = struct.Struct("<" + self.layout(offset))
        return compiled


def _slices(run: Sequence[_Field]) -> Iterator[str]:
    start = 0
    for field in run:
        yield f"found[{start}]" if field.count == 1 else f"found[{start}:{start + field.count}]"
        start += field.count


def _compiled(argument: str, parts: Iterable[str]) -> Callable[[Any], Sequence[Any]]:
    """A function of one argument that returns a tuple of expressions, as ``dataclass`` makes its own.

    One expression without a loop takes a fifth of the time of getting field after field by name.
    """
    listed = "".join(part + "," for part in parts)
    made: Callable[[Any], Sequence[Any]] = eval(f"lambda {argument}: ({listed})")
    return made


class Text:
    """One string."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._get: Callable[[Message], str] = attrgetter(name)

    def put(self, out: bytearray, message: Message) -> None:
        """Append the string of a message."""
        _put_text(out, self._get(message))

    def take(self, data: bytes, position: int, values: list[Any]) -> int:
        """Append the string found at a position; return the position behind it."""
        text, position = _take_text(data, position)
        values.append(text)
        return position


class Texts:
    """A sequence of strings."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._get: Callable[[Message], Sequence[str]] = attrgetter(name)

    def put(self, out: bytearray, message: Message) -> None:
        """Append the strings of a message."""
        texts = self._get(message)
        out += _TO_FOUR[len(out) & 3] + _LENGTH.pack(len(texts))
        for text in texts:
            _put_text(out, text)

    def take(self, data: bytes, position: int, values: list[Any]) -> int:
        """Append the strings found at a position; return the position behind them."""
        count, position = _take_length(data, position)
        texts = []
        for _ in range(count):
            text, position = _take_text(data, position)
            texts.append(text)
        values.append(tuple(texts))
        return position


class Numbers:
    """A sequence of numbers; bytes and NumPy arrays stay what they are."""

    def __init__(self, name: str, base: str) -> None:
        self.name, self.base = name, base
        self._code, self.size = _PRIMITIVES[base]
        self._get: Callable[[Message], Any] = attrgetter(name)
        self._structs: dict[int, struct.Struct] = {}

    def put(self, out: bytearray, message: Message) -> None:
        """Append the numbers of a message."""
        value = self._get(message)
        count = len(value)
        out += _TO_FOUR[len(out) & 3] + _LENGTH.pack(count)
        if count and self.size == 8 and len(out) & 7 == 0:  # alignment counts from behind the encapsulation
            out += b"\0\0\0\0"
        if isinstance(value, bytes):
            out += value
        elif isinstance(value, np.ndarray):
            if value.dtype.char != self._code:  # hearers in memory would see other numbers than a recording's
                raise TypeError(f"{self.name}: expected {self.base}, found {value.dtype}")
            out += value.astype(value.dtype.newbyteorder("<"), copy=False).tobytes()
        else:
            out += self._layout(count).pack(*value)

    def take(self, data: bytes, position: int, values: list[Any]) -> int:
        """Append the numbers found at a position; return the position behind them."""
        count, position = _take_length(data, position)
        if count and self.size == 8 and position & 7 == 0:
            position += 4
        stop = position + count * self.size
        if stop > len(data):
            raise ValueError("sequence is cut off")
        if self.base == "uint8":
            values.append(data[position:stop])
        elif self.base == "float32":
            values.append(np.frombuffer(data, dtype=np.float32, count=count, offset=position))
        else:
            values.append(self._layout(count).unpack_from(data, position))
        return stop

    def _layout(self, count: int) -> struct.Struct:
        compiled = self._structs.get(count)
        if compiled is None:
            compiled = struct.Struct(f"<{count}{self._code}")
            if count <= _SHORT:  # lengths of a few numbers come back, others are many
                self._structs[count] = compiled
        return compiled


Part = Run | Text | Texts | Numbers


def parts(cls: type[Message]) -> Iterator[Part]:
    """The fields of a class behind its header, those of fixed size together."""
    parsed = [_parse(name, ros_type) for name, ros_type in ros_fields(cls)]
    for is_fixed, group in groupby(parsed, lambda field: field.base != "string" and field.count > 0):
        if is_fixed:
            yield Run(tuple(group))
            continue
        for field in group:
            if field.base != "string":
                yield Numbers(field.name, field.base)
            else:
                yield Text(field.name) if field.count == 1 else Texts(field.name)


def _put_text(out: bytearray, text: str) -> None:
    out += _TO_FOUR[len(out) & 3] + (_packed(text) if len(text) < _SHORT else _pack_text(text))


def _pack_text(text: str) -> bytes:
    raw = text.encode() + b"\0"
    return _LENGTH.pack(len(raw)) + raw


_packed = lru_cache(512)(_pack_text)  # states, modes, names of units: the same few texts again and again


def _take_length(data: bytes, position: int) -> tuple[int, int]:
    position += -position & 3
    return _LENGTH.unpack_from(data, position)[0], position + 4


def _take_text(data: bytes, position: int) -> tuple[str, int]:
    position += -position & 3
    start = position + 4
    stop = start + _LENGTH.unpack_from(data, position)[0]
    raw = data[start:stop]
    if len(raw) != stop - start or not raw.endswith(b"\0"):
        raise ValueError("string is cut off")
    return raw[:-1].decode(), stop
