"""What programs outside the station send, as it arrived and as it was read, and what they are answered."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import F64, PACKAGE, U32, Bytes, Float64x2, Message, Text
from groundstation.declarations.topic import Rank, Scope, Topic


@dataclass(frozen=True, slots=True, eq=False)
class OutsideText(Message):
    """A text of a program outside, as it arrived.

    Attributes:
        key: ``outside/VEHICLE/wrench`` or ``outside/VEHICLE/request``.
        content: Its bytes; of one that is too long the first ones.
        replaced: How many older ones on this key were given up since the last that was read.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/OutsideText"
    TOPIC: ClassVar = Topic("outside_text", rank=Rank.REQUEST, scope=Scope.RIG)
    key: Text
    content: Bytes
    replaced: U32


@dataclass(frozen=True, slots=True, eq=False)
class OutsideWrench(Message):
    """A wrench that a program outside wants of a vehicle; the multiplexer decides whether it counts.

    Attributes:
        author: In whose name.
        wrench_id: The program's own number of it.
        force_body_n: Mean force, x and y.
        torque_nm: About z.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/OutsideWrench"
    TOPIC: ClassVar = Topic("outside_wrench", rank=Rank.COMMAND, scope=Scope.PROCESS)
    author: Text
    wrench_id: U32
    force_body_n: Float64x2
    torque_nm: F64


@dataclass(frozen=True, slots=True, eq=False)
class OutsideAnswer(Message):
    """An answer to a program outside, as it leaves.

    Attributes:
        key: ``outside/VEHICLE/answer``.
        content: JSON object.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/OutsideAnswer"
    TOPIC: ClassVar = Topic("outside_answer", rank=Rank.REQUEST, scope=Scope.RIG)
    key: Text
    content: Text
