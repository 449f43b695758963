"""ROS 2 message definitions of the payloads, as text: what recordings and bridges carry as a schema.

Own payloads are generated from their annotations. Standard types are flat payload classes with the
wire layout of a nested ROS type; their text is the ROS definition itself, so that viewers know them.

Source: ROS 2 common_interfaces (std_msgs, geometry_msgs, sensor_msgs); the separator of concatenated
definitions is that of the MCAP registry's ``ros2msg`` schema encoding.
"""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from groundstation.bus.cdr import ros_fields
from groundstation.declarations.message import Message

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

ENCODING = "ros2msg"
_SEPARATOR = "=" * 80 + "\n"
_HEADER = "std_msgs/Header header\n"

_STANDARD = {
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec\n",
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "geometry_msgs/msg/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/msg/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    "geometry_msgs/msg/WrenchStamped": _HEADER + "geometry_msgs/Wrench wrench\n",
    "sensor_msgs/msg/Image": _HEADER
    + "uint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n",
    "sensor_msgs/msg/CompressedImage": _HEADER + "string format\nuint8[] data\n",
}


def is_standard(cls: type[Message]) -> bool:
    """Whether the payload travels as a type that ROS 2 itself defines."""
    return cls.ROS_TYPE in _STANDARD


def message_text(cls: type[Message]) -> str:
    """The ``.msg`` text of one payload class, without the types it refers to."""
    standard = _STANDARD.get(cls.ROS_TYPE)
    if standard is not None:
        return standard
    return _HEADER + "".join(f"{ros_type} {name}\n" for name, ros_type in ros_fields(cls))


def schema_text(cls: type[Message]) -> str:
    """The ``.msg`` text followed by that of every type it refers to, each once, in order of first use."""
    text = message_text(cls)
    parts = [text]
    seen = {cls.ROS_TYPE}
    waiting = _referred(text)
    while waiting:
        name = waiting.pop(0)
        if name in seen:
            continue
        seen.add(name)
        definition = _STANDARD[name]
        parts.append(f"MSG: {name.replace('/msg/', '/')}\n{definition}")
        waiting = _referred(definition) + waiting
    return _SEPARATOR.join(parts)


def register(typestore: "Typestore", classes: Iterable[type[Message]]) -> None:
    """Teach a rosbags typestore the types of our own package.

    Args:
        typestore: A store that knows the ROS 2 standard types.
        classes: Payload classes; those of standard types are skipped.
    """
    from rosbags.typesys import get_types_from_msg  # only tools need rosbags: recording does without

    for cls in classes:
        if not is_standard(cls):
            typestore.register(get_types_from_msg(message_text(cls), cls.ROS_TYPE))


def _referred(text: str) -> list[str]:
    """Full names of the types that the fields of a definition refer to."""
    types = (line.split(" ", 1)[0].partition("[")[0] for line in text.splitlines())
    return ["/msg/".join(name.split("/")) for name in types if "/" in name]
