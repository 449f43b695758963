"""Reads fields of a recording as arrays: what comes too often to be decoded message by message."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.cdr import CodecError
from groundstation.bus.cdr_columns import Columns, columns_of, decode_columns, joined
from groundstation.bus.ros_schema import schema_text
from groundstation.declarations.message import Message
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.records import MESSAGE, RECORD
from groundstation.recording.schemas import decoder_of

Ints = NDArray[np.int64]
Key = tuple[type[Message], str]
"""Class and owner."""
BATCH_BYTES = 1 << 23
"""Of unpacked records that are looked at together: enough for NumPy, little for memory."""
_HEAD = RECORD.size + MESSAGE.size
_HEAD_FIELDS = np.dtype([("channel", "<u2"), ("sequence", "<u4"), ("log_ns", "<u8"), ("publish_ns", "<u8")])


class Heads(NamedTuple):
    """What the file states of each message beside its payload; shape (n,) each."""

    sequence: Ints
    log_ns: Ints
    publish_ns: Ints


def read_heads(recording: Recording, kind: type[Message], owner: str) -> Heads:
    """The heads of all messages of a class and owner, in the order of the file.

    Raises:
        RecordingError: A chunk is damaged.
    """
    found: list[NDArray[np.void]] = [np.empty(0, _HEAD_FIELDS)]
    for data, here in recording.spans([kind], [owner]):
        for span in here:
            places = np.array(span.places, np.int64) + RECORD.size
            raw = np.frombuffer(data, np.uint8)
            found.append(raw[places[:, None] + np.arange(_HEAD_FIELDS.itemsize)].view(_HEAD_FIELDS)[:, 0])
    heads = np.concatenate(found)
    return Heads(*(heads[name].astype(np.int64) for name in Heads._fields))


def read_columns(
    recording: Recording,
    wanted: Mapping[type[Message], Iterable[str]],
    owners: Collection[str] | None = None,
) -> dict[Key, Columns]:
    """Fields of every message of some classes, by class and owner, in the order of the file.

    Args:
        recording: To be read from its beginning to its end.
        wanted: Names of fields, by class.
        owners: Only of these vehicles or processes; None for all.

    Raises:
        RecordingError: A chunk or a payload is damaged, or the file lacks a field of a class of today.
    """
    found: dict[Key, list[Columns]] = defaultdict(list)
    chunks: list[bytes] = []
    spans: dict[Key, tuple[str, list[int]]] = {}
    size = 0

    def decode() -> None:
        data = b"".join(chunks)
        for (kind, owner), (schema, places) in spans.items():
            where = f"{recording.path}: /{owner}/{kind.TOPIC.noun}"
            names = tuple(dict.fromkeys(wanted[kind]))
            try:
                found[kind, owner].append(_decoded(kind, names, data, places, schema, where))
            except CodecError as error:
                raise RecordingError(f"{where}: {error}") from error
        chunks.clear()
        spans.clear()

    for data, here in recording.spans(wanted, owners):
        for span in here:
            places = spans.setdefault((span.kind, span.owner), (span.schema, []))[1]
            places += [size + place for place in span.places]
        chunks.append(data)
        size += len(data)
        if size > BATCH_BYTES:
            decode()
            size = 0
    decode()
    return {key: joined(pieces) for key, pieces in found.items()}


def _decoded(
    kind: type[Message], names: tuple[str, ...], data: bytes, places: list[int], schema: str, where: str
) -> Columns:
    starts = np.array(places, np.int64)
    raw = np.frombuffer(data, np.uint8)
    lengths = raw[starts[:, None] + np.arange(1, RECORD.size)].view("<u8")[:, 0].astype(np.int64)
    stops = starts + RECORD.size + lengths
    if np.any(stops > len(data)):
        raise CodecError("a record is cut off")
    if schema == schema_text(kind):
        return decode_columns(kind, names, raw, starts + _HEAD, stops)
    decode = decoder_of(kind, schema, where)
    pairs = zip(starts.tolist(), stops.tolist(), strict=True)
    return columns_of([decode(data[start + _HEAD : stop]) for start, stop in pairs], names)
