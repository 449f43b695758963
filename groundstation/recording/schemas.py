"""Decodes recorded payloads by the schemas of their own file.

Where the file's schema is today's, the codec of the class reads it. Where it is another (fields added since,
or in another order), a codec made from the file's text reads the bytes, and the class takes the fields by
their names.
"""

import struct
from collections.abc import Callable
from dataclasses import fields, make_dataclass
from typing import Annotated, Any

from groundstation.bus.cdr import Codec, CodecError, codec_of
from groundstation.bus.ros_schema import is_standard, message_text, schema_text
from groundstation.declarations.message import Message
from groundstation.recording.errors import RecordingError

Decode = Callable[[bytes], Message]


def decoder_of(kind: type[Message], recorded: str, where: str) -> Decode:
    """What makes payloads of a class from recorded bytes.

    Args:
        kind: Class to make.
        recorded: Schema text of the file's channel.
        where: Name of file and channel, for people.

    Raises:
        RecordingError: The file's schema cannot be read, lacks a field of the class, or has it in another
            type. What is returned raises it for bytes that are no such payload.
    """
    read = _reader(kind, recorded, where)

    def decode(data: bytes) -> Message:
        try:
            found = read(data)
            found.check()
        except CodecError as error:
            raise RecordingError(f"{where} holds a damaged message ({error})") from error
        return found

    return decode


def _reader(kind: type[Message], recorded: str, where: str) -> Decode:
    """The same, raising CodecError for bytes that are no such payload."""
    if recorded == schema_text(kind):
        return codec_of(kind).decode
    if is_standard(kind):
        raise RecordingError(f"{where} holds another type than {kind.ROS_TYPE}")
    try:
        old = _fields(recorded)
        codec = _codec(kind, old)
    except (KeyError, TypeError, ValueError, struct.error) as error:
        raise RecordingError(f"{where} has a schema that cannot be read ({error})") from error
    types = dict(old)
    for name, ros_type in _fields(message_text(kind)):
        if name not in types:
            raise RecordingError(f"{where} was recorded without the field '{name}'")
        if types[name] != ros_type:
            raise RecordingError(f"{where} was recorded with {name} as {types[name]}, expected {ros_type}")
    wanted = [field.name for field in fields(kind)]

    def read(data: bytes) -> Message:
        found = codec.decode(data)
        return kind(**{name: getattr(found, name) for name in wanted})

    return read


def _codec(kind: type[Message], columns: list[tuple[str, str]]) -> Codec[Any]:
    """The codec of a class as the file had it."""
    annotated = [(name, Annotated[Any, ros_type]) for name, ros_type in columns]
    return Codec(make_dataclass(kind.__name__, annotated, bases=(Message,), eq=False, frozen=True))


def _fields(text: str) -> list[tuple[str, str]]:
    """Name and type of each field behind the header."""
    own = text.partition("=" * 80)[0]
    rows = (line.split(" ", 1) for line in own.splitlines() if line.strip())
    return [(name.strip(), ros_type) for ros_type, name in rows if ros_type != "std_msgs/Header"]
