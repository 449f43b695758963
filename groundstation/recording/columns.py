"""Reads fields of a recording as arrays: what comes too often to be decoded message by message."""

from collections import defaultdict
from collections.abc import Iterable, Mapping

import numpy as np

from groundstation.bus.cdr import CodecError
from groundstation.bus.cdr_columns import Columns, columns_of, decode_columns, joined
from groundstation.bus.ros_schema import schema_text
from groundstation.declarations.message import Message
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.records import MESSAGE, RECORD
from groundstation.recording.schemas import decoder_of

Key = tuple[type[Message], str]
"""Class and owner."""
BATCH_BYTES = 1 << 23
"""Of unpacked records that are looked at together: enough for NumPy, little for memory."""
_HEAD = RECORD.size + MESSAGE.size


def read_columns(recording: Recording, wanted: Mapping[type[Message], Iterable[str]]) -> dict[Key, Columns]:
    """Fields of every message of some classes, by class and owner, in the order of the file.

    Args:
        recording: To be read from its beginning to its end.
        wanted: Names of fields, by class.

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

    for data, here in recording.spans(wanted):
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
