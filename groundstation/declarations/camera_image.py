"""A camera's picture as a message; each camera's topic is a class of its own."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import I64, PACKAGE, U32, Bytes, Message, Text


@dataclass(frozen=True, slots=True, eq=False)
class CameraImage(Message):
    """One picture; the stamp is its arrival.

    Attributes:
        device_stamp_ns: When the camera's driver had it, on the same clock; 0 where it does not state it.
        height: Rows.
        width: Columns.
        encoding: ``mono8`` or ``bgr8``.
        step: Bytes of a row.
        data: Row after row, the top one first.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CameraImage"
    device_stamp_ns: I64
    height: U32
    width: U32
    encoding: Text
    step: U32
    data: Bytes
