"""The base of every payload, and the ROS 2 field types it is written in.

A payload is a frozen dataclass whose annotations carry the ROS 2 type of each field, so that one
definition gives the Python class, the ``.msg`` text, the CDR layout and the schema of recordings.
Every payload begins with ``stamp_ns`` and ``vehicle``; on the wire they are a ``std_msgs/Header``
(``frame_id`` is the vehicle's name, empty for what belongs to the whole rig).

A payload must survive its codec unchanged, bit for bit: a recording replays exactly only then.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from drivers.quick_record import quickly_made
from groundstation.declarations.topic import Topic

PACKAGE = "air_table_msgs"
"""ROS 2 package of our own message types."""

Bool = Annotated[bool, "bool"]
U8 = Annotated[int, "uint8"]
U16 = Annotated[int, "uint16"]
U32 = Annotated[int, "uint32"]
U64 = Annotated[int, "uint64"]
I64 = Annotated[int, "int64"]
F64 = Annotated[float, "float64"]
Text = Annotated[str, "string"]
Bytes = Annotated[bytes, "uint8[]"]
Float32Array = Annotated[NDArray[np.float32], "float32[]"]
Float64x2 = Annotated[tuple[float, float], "float64[2]"]
Float64x3 = Annotated[tuple[float, float, float], "float64[3]"]
Float64x4 = Annotated[tuple[float, float, float, float], "float64[4]"]
Float64x9 = Annotated[tuple[float, ...], "float64[9]"]
Float64Sequence = Annotated[tuple[float, ...], "float64[]"]
TextSequence = Annotated[tuple[str, ...], "string[]"]


@dataclass(frozen=True, slots=True, eq=False)
class Message:
    """What every payload carries.

    Attributes:
        stamp_ns: The moment that the payload is about, host monotonic clock, int64 nanoseconds.
        vehicle: Name of the mock-up, empty where the payload belongs to the whole rig.
    """

    ROS_TYPE: ClassVar[str] = ""
    TOPIC: ClassVar[Topic]

    stamp_ns: int
    vehicle: str

    def check(self) -> None:
        """Refuse content that does not hold together, where bytes of a file became this payload.

        Raises:
            CodecError: With what is wrong.
        """

    def __init_subclass__(cls) -> None:
        if "__slots__" in vars(cls):  # what the decorator makes in the end: the class with its slots
            quickly_made(cls)
