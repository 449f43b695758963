"""Payload classes made from the schemas of a file: what it takes to read a recording by itself alone.

Names and units of the fields are those of the file. Standard types of ROS 2 have names without units, so
theirs are named here as the payload classes of this program name them.
"""

from dataclasses import make_dataclass
from functools import lru_cache
from typing import Annotated, Any

from groundstation.declarations.message import PACKAGE, Message
from groundstation.declarations.topic import Topic
from groundstation.recording.errors import RecordingError

Fields = tuple[tuple[str, str], ...]
_STANDARD: dict[str, Fields] = {
    "geometry_msgs/msg/WrenchStamped": tuple(
        (f"{what}_{axis}_{unit}", "float64")
        for what, unit in (("force", "n"), ("torque", "nm"))
        for axis in "xyz"
    ),
    "sensor_msgs/msg/CompressedImage": (("format", "string"), ("data", "uint8[]")),
}


@lru_cache(256)
def class_of_schema(noun: str, schema_name: str, schema: str) -> type[Message]:
    """The payload class of a channel.

    Args:
        noun: Of its topic.
        schema_name: Of its type, such as ``air_table_msgs/msg/VehicleState``.
        schema: The file's ``.msg`` text.

    Raises:
        RecordingError: The type is none that this program writes.
    """
    fields = fields_of(schema_name, schema)
    try:
        columns = [(name, Annotated[Any, ros_type]) for name, ros_type in fields]
        made: type[Message] = make_dataclass(
            schema_name.rpartition("/")[2] or noun,
            columns,
            bases=(Message,),
            namespace={"TOPIC": Topic(noun), "ROS_TYPE": schema_name},
            eq=False,
            frozen=True,
        )
    except (TypeError, ValueError) as error:
        raise RecordingError(f"{schema_name} has fields that cannot be read ({error})") from error
    return made


def fields_of(schema_name: str, schema: str) -> Fields:
    """Name and ROS 2 type of each field behind the header.

    Raises:
        RecordingError: The type is none that this program writes.
    """
    if schema_name in _STANDARD:
        return _STANDARD[schema_name]
    lines = [line.split("#")[0].strip() for line in schema.partition("=" * 80)[0].splitlines()]
    rows = [tuple(line.split(None, 1)) for line in lines if line]
    if not schema_name.startswith(f"{PACKAGE}/") or not rows or rows[0] != ("std_msgs/Header", "header"):
        raise RecordingError(f"it is of type {schema_name}, which is none of this program's")
    return tuple((row[1], row[0]) for row in rows[1:])


def is_table(schema_name: str) -> bool:
    """Whether messages of a type are rows of a table: ours, but no pictures."""
    noun = schema_name.rpartition("/")[2]
    if noun.endswith("Image"):
        return False
    return schema_name in _STANDARD or schema_name.startswith(f"{PACKAGE}/")
