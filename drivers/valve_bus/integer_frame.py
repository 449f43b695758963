"""Packs the two frames that pass fifty times a second per vehicle, by the layout that the DBC gives.

cantools builds dictionaries and scales floats for every frame; here the DBC's start bits and lengths are
read once and the frame is one integer. Only for little-endian unsigned signals of scale one, which is
checked; a test holds it equal to cantools.
"""

from collections.abc import Sequence

from cantools.database.can import Message


class IntegerFrame:
    """The layout of one message of the DBC.

    Args:
        message: All of whose signals are unsigned integers, little-endian, without scale and offset.

    Raises:
        ValueError: A signal is of another kind.
    """

    def __init__(self, message: Message) -> None:
        signals = sorted(message.signals, key=lambda signal: signal.start)
        for signal in signals:
            is_plain = signal.byte_order == "little_endian" and not signal.is_signed and not signal.is_float
            if not is_plain or signal.scale != 1 or signal.offset != 0:
                raise ValueError(f"{message.name}.{signal.name} is no plain unsigned integer")
        self.names = tuple(signal.name for signal in signals)
        self.length = message.length
        self._places = tuple((signal.start, (1 << signal.length) - 1) for signal in signals)

    def pack(self, values: Sequence[int]) -> bytes:
        """The frame of values that stand in the order of ``names``.

        Raises:
            ValueError: A value does not fit its bits.
        """
        whole = 0
        for (start, mask), value in zip(self._places, values, strict=True):
            if value & ~mask:
                name = self.names[self._places.index((start, mask))]
                raise ValueError(f"{name} is {value}, which is outside 0..{mask}")
            whole |= value << start
        return whole.to_bytes(self.length, "little")

    def unpack(self, data: bytes) -> list[int]:
        """The values of a frame, in the order of ``names``."""
        whole = int.from_bytes(data, "little")
        return [whole >> start & mask for start, mask in self._places]
