"""From what each message was made, read from the journal of a recording."""

from collections.abc import Iterator

from groundstation.bus.journal import Journal, Kind, read_entries
from groundstation.declarations.message import Message
from groundstation.recording.reader import Recording

Made = dict[int, int]
"""Sequence of an output to the sequence of the input it answered."""


def made_from(recording: Recording, node: str, heard: type[Message], said: type[Message]) -> Made:
    """Which input of a node led to which output, by sequence number.

    Args:
        recording: Its journal is read.
        node: Key of the node, ``alpha/imu_reader``.
        heard: Payload class of the input.
        said: Payload class of the output.
    """
    heard_index, said_index = heard.TOPIC.index, said.TOPIC.index
    made: Made = {}
    trigger: int | None = None
    for kind, topic, sequence in _entries(recording, node):
        if kind == Kind.OUTPUT:
            if trigger is not None and topic == said_index:
                made[sequence] = trigger
        elif kind == Kind.INPUT and topic == heard_index:
            trigger = sequence
        else:
            trigger = None
    return made


def consumed(recording: Recording, node: str, heard: type[Message]) -> set[int]:
    """Sequence numbers of the inputs of one class that a node took."""
    index = heard.TOPIC.index
    entries = _entries(recording, node)
    return {sequence for kind, topic, sequence in entries if kind == Kind.INPUT and topic == index}


def _entries(recording: Recording, node: str) -> Iterator[tuple[int, int, int]]:
    """Kind, row of the topic and sequence of each entry of one node, in order."""
    for message in recording.messages([Journal.TOPIC]):
        payload = message.payload
        assert isinstance(payload, Journal)
        if node in payload.names:
            entries = read_entries(payload.entries)
            own = entries[entries["node"] == payload.names.index(node)]
            columns = (own[name].tolist() for name in ("kind", "topic", "sequence"))
            yield from zip(*columns, strict=True)
