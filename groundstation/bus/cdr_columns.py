"""Fields of many encoded payloads of one class at once, as arrays.

A recording holds hundreds of thousands of states: decoding them one by one takes a hundred times as long as
what is then made of them. Texts come as bytes, sequences of bytes as rows filled up with zeros.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.cdr import ENCAPSULATION, CodecError
from groundstation.bus.cdr_fields import Numbers, Run, Text, Texts, parts
from groundstation.declarations.message import Message

Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
_HEAD = np.dtype([("encapsulation", "S4"), ("s", "<u4"), ("ns", "<u4")])
_NS = 1_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Messages of one class and owner, in the order of a recording.

    Attributes:
        stamp_ns: Of each; shape (n,).
        fields: Fields by name, shape (n,) or (n, k).
    """

    stamp_ns: Ints
    fields: Mapping[str, NDArray[Any]]

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.fields[name]

    def __len__(self) -> int:
        return len(self.stamp_ns)


def joined(pieces: Sequence[Columns]) -> Columns:
    """One after the other; rows of different width are filled up with zeros."""
    names = pieces[0].fields
    return Columns(
        np.concatenate([piece.stamp_ns for piece in pieces]),
        {name: _stacked([piece[name] for piece in pieces]) for name in names},
    )


def columns_of(payloads: Sequence[Message], names: Iterable[str]) -> Columns:
    """The same of messages that are decoded already."""
    stamps_ns = np.array([payload.stamp_ns for payload in payloads], np.int64)
    return Columns(
        stamps_ns, {name: _array([getattr(payload, name) for payload in payloads]) for name in names}
    )


def decode_columns(
    kind: type[Message], names: Collection[str], data: Bytes, starts: Ints, stops: Ints
) -> Columns:
    """Read fields of many payloads.

    Args:
        kind: Class of all.
        names: Fields wanted; none of them behind a sequence of texts.
        data: Bytes that hold the payloads, anything between them.
        starts: Where each begins; shape (n,).
        stops: Where each ends; shape (n,).

    Raises:
        CodecError: A payload is cut off or is no little-endian CDR.
    """
    if not len(starts):
        return Columns(np.empty(0, np.int64), {name: _array([]) for name in names})
    if np.any(stops - starts < _HEAD.itemsize):
        raise CodecError(f"{kind.__name__}: cut off")
    head = _rows(data, starts, _HEAD)
    if np.any(head["encapsulation"].astype("S4") != np.array(ENCAPSULATION, "S4")):
        raise CodecError(f"{kind.__name__}: expected little-endian CDR")
    reader = _Reader(data, starts + len(ENCAPSULATION), stops, starts + _HEAD.itemsize, kind.__name__)
    reader.pass_by(1)  # the name of the vehicle
    found: dict[str, NDArray[Any]] = {}
    for part in parts(kind):
        if len(found) == len(names):
            break
        if isinstance(part, Run):
            found |= reader.run(part, names)
        elif isinstance(part, Texts):
            raise TypeError(f"{kind.__name__}.{part.name} is a sequence of texts: what is there is no column")
        elif part.name in names:
            found[part.name] = reader.padded(part)
        else:
            reader.pass_by(part.size if isinstance(part, Numbers) else 1)
    return Columns(head["s"].astype(np.int64) * _NS + head["ns"], found)


class _Reader:
    """A place in every payload, and what is read there."""

    def __init__(self, data: Bytes, origins: Ints, stops: Ints, places: Ints, name: str) -> None:
        self._data, self._origins, self._stops, self._places, self._name = data, origins, stops, places, name

    def run(self, run: Run, names: Collection[str]) -> dict[str, NDArray[Any]]:
        """Fields of fixed size; how they lie depends on what came before in each payload."""
        offsets = (self._places - self._origins) & 7
        wanted = [name for name in run.names if name in names]
        found: dict[str, NDArray[Any]] = {}
        for offset in np.unique(offsets).tolist():
            dtype, here = run.dtype(offset), np.flatnonzero(offsets == offset)
            places = self._places[here]
            self._places[here] = self._checked(places + dtype.itemsize, self._stops[here])
            if not wanted:
                continue
            rows = _rows(self._data, places, dtype)
            for name in wanted:
                field = rows[name]
                if name not in found:
                    found[name] = np.empty((len(self._places), *field.shape[1:]), field.dtype)
                found[name][here] = field
        return found

    def padded(self, part: Text | Numbers) -> NDArray[Any]:
        """A text as bytes, or a sequence of bytes as a row."""
        if isinstance(part, Numbers) and part.base != "uint8":
            raise TypeError(f"{self._name}.{part.name} is a sequence of {part.base}: no column")
        begins, lengths = self._length(1)
        self._places = self._checked(begins + lengths, self._stops)
        width = max(int(lengths.max()), 1)
        places = np.minimum(begins[:, None] + np.arange(width), len(self._data) - 1)
        rows = np.where(np.arange(width) < lengths[:, None], self._data[places], np.uint8(0))
        if isinstance(part, Numbers):
            return rows
        return np.ascontiguousarray(rows).view(f"S{width}")[:, 0]

    def pass_by(self, size: int) -> None:
        """A text or a sequence of numbers of this size that nobody wants."""
        begins, lengths = self._length(size)
        self._places = self._checked(begins + lengths * size, self._stops)

    def _length(self, size: int) -> tuple[Ints, Ints]:
        """Where the elements begin, and how many they are."""
        places = self._places + (-(self._places - self._origins) & 3)
        self._checked(places + 4, self._stops)
        lengths = _rows(self._data, places, np.dtype("<u4")).astype(np.int64)
        begins = places + 4
        if size == 8:  # alignment of the first element, where there is one
            begins = begins + np.where(lengths > 0, -(begins - self._origins) & 7, 0)
        return begins, lengths

    def _checked(self, places: Ints, stops: Ints) -> Ints:
        if np.any(places > stops):
            raise CodecError(f"{self._name}: cut off")
        return places


def _rows(data: Bytes, places: Ints, dtype: np.dtype[Any]) -> NDArray[Any]:
    """What lies at each place."""
    found: NDArray[Any] = data[places[:, None] + np.arange(dtype.itemsize)].view(dtype)[:, 0]
    return found


def _array(values: list[Any]) -> NDArray[Any]:
    """A column of fields that were decoded; shape (n,) or (n, k)."""
    if not values:
        return np.empty(0)
    if isinstance(values[0], bytes):
        rows = np.zeros((len(values), max(1, *map(len, values))), np.uint8)
        for row, value in zip(rows, values, strict=True):
            row[: len(value)] = np.frombuffer(value, np.uint8)
        return rows
    if isinstance(values[0], str):
        return np.array([value.encode() for value in values])
    return np.array(values)


def _stacked(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    there = [array for array in arrays if len(array)] or [arrays[0]]
    if there[0].ndim == 2 and len({array.shape[1] for array in there}) > 1:
        width = max(array.shape[1] for array in there)
        there = [np.pad(array, ((0, 0), (0, width - array.shape[1]))) for array in there]
    return np.concatenate(there)
