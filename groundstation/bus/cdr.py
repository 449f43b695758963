"""CDR codec of the payloads: little-endian XCDR1 with the 4-byte encapsulation header of ROS 2.

Layouts are compiled once per class (``cdr_fields``); the header and the fixed fields behind it are one piece.

Source: OMG DDS-XTypes 1.3, section 7.4.1 (plain CDR); ROS 2 uses it with representation id 0x0001.
"""

import functools
import struct
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from groundstation.bus.cdr_fields import Part, Run, parts, ros_fields
from groundstation.declarations.errors import NodeError
from groundstation.declarations.message import Message

__all__ = ["ENCAPSULATION", "Codec", "CodecError", "codec_of", "ros_fields", "stamp_of"]

ENCAPSULATION = b"\x00\x01\x00\x00"
_NS = 1_000_000_000
_STAMP = struct.Struct("<4sII")
_MAX_PADDING = 3  # DDS may round a serialised payload up to four bytes

M = TypeVar("M", bound=Message)


class CodecError(ValueError):
    """Bytes that are no message of the expected type."""


class Codec(Generic[M]):
    """Encodes and decodes one class of payload.

    Args:
        cls: The payload's class, annotated with ROS 2 types.
    """

    def __init__(self, cls: type[M]) -> None:
        self._cls = cls
        self._build: Callable[..., M] = cls
        first, *rest = [*parts(cls)] or [Run(())]
        # what follows the header at a fixed distance is packed together with it
        self._first = first if isinstance(first, Run) else Run(())
        self._flat = self._first.flat
        self._rest: tuple[Part, ...] = tuple(rest if first is self._first else (first, *rest))
        self._openings: dict[int, struct.Struct] = {}
        self._heads: dict[str, tuple[Callable[..., bytes], int, bytes]] = {}  # by the name of the vehicle

    def encode(self, message: M) -> bytes:
        """Serialise a payload, encapsulation header included.

        Raises:
            NodeError: Whoever made the payload gave a field a value of another type or out of its range.
        """
        try:
            pack, length, name = self._heads.get(message.vehicle) or self._head(message.vehicle)
            seconds, nanoseconds = divmod(message.stamp_ns, _NS)
            head = pack(ENCAPSULATION, seconds, nanoseconds, length, name, *self._flat(message))
            if not self._rest:
                return head
            out = bytearray(head)
            for part in self._rest:
                part.put(out, message)
        except (struct.error, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise NodeError(f"{message!r:.300} was published and does not fit its fields: {error}") from error
        return bytes(out)

    def decode(self, data: bytes) -> M:
        """Read a payload back.

        Raises:
            CodecError: The bytes are cut off or are no little-endian CDR.
        """
        if data[:4] != ENCAPSULATION:
            raise CodecError(f"{self._cls.__name__}: expected little-endian CDR, found {data[:4].hex()}")
        length = int.from_bytes(data[12:16], "little")
        if 16 + length > len(data):
            raise CodecError(f"{self._cls.__name__}: cut off after {len(data)} bytes")
        try:
            opening = self._openings.get(length) or self._opening(length)
            found = opening.unpack_from(data)
            values: list[Any] = [found[1] * _NS + found[2], found[4][:-1].decode()]
            values += self._first.gathered(found[5:])
            position = opening.size
            for part in self._rest:
                position = part.take(data, position, values)
        except (struct.error, ValueError) as error:
            raise CodecError(f"{self._cls.__name__}: {len(data)} bytes do not fit the layout") from error
        if position > len(data):
            raise CodecError(f"{self._cls.__name__}: cut off after {len(data)} bytes")
        if len(data) - position > _MAX_PADDING:
            raise CodecError(f"{self._cls.__name__}: {len(data) - position} bytes too many")
        return self._build(*values)

    def _head(self, vehicle: str) -> tuple[Callable[..., bytes], int, bytes]:
        """What packs the head of this vehicle's messages, and its name as packed there."""
        name = vehicle.encode() + b"\0"
        opening = self._openings.get(len(name)) or self._opening(len(name))
        found = self._heads[vehicle] = opening.pack, len(name), name
        return found

    def _opening(self, length: int) -> struct.Struct:
        """Encapsulation, header with a name of ``length`` bytes, and the first run."""
        layout = self._first.layout(12 + length)
        compiled = self._openings[length] = struct.Struct(f"<4siII{length}s{layout}")
        return compiled


def stamp_of(data: bytes) -> int:
    """Stamp (ns) of an encoded payload, whatever its class: the header comes first in all.

    Raises:
        CodecError: The bytes are cut off or are no little-endian CDR.
    """
    try:
        encapsulation, seconds, nanoseconds = _STAMP.unpack_from(data)
    except struct.error as error:
        raise CodecError(f"cut off after {len(data)} bytes") from error
    if encapsulation != ENCAPSULATION:
        raise CodecError(f"expected little-endian CDR, found {data[:4].hex()}")
    stamp_ns: int = seconds * _NS + nanoseconds
    return stamp_ns


@functools.cache
def _compiled(cls: Any) -> Any:  # noqa: ANN401 - a class is hashable, which mypy doubts
    return Codec(cls)


def codec_of(cls: type[M]) -> Codec[M]:
    """The codec of a class, compiled at the first call."""
    kind: Any = cls
    found: Codec[M] = _compiled(kind)
    return found
