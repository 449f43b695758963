"""From what each message was made, read from the journal of a recording."""

from collections.abc import Iterator

from groundstation.bus.journal import Entry, Journal, Kind, read_entries
from groundstation.declarations.message import Message
from groundstation.recording.reader import Recording

Made = dict[int, int]
"""Sequence of an output to the sequence of the input it answered."""


def made_from(recording: Recording, node: str, received: type[Message], published: type[Message]) -> Made:
    """Which input of a node led to which output, by sequence number.

    Args:
        recording: Its journal is read.
        node: Key of the node, ``alpha/imu_reader``; both topics are its vehicle's.
        received: Payload class of the input.
        published: Payload class of the output.
    """
    made: Made = {}
    trigger: int | None = None
    owner = node.partition("/")[0]
    for entry in _entries(recording, node):
        if entry.kind == Kind.OUTPUT:
            if trigger is not None and entry.noun == published.TOPIC.noun:
                made[entry.sequence] = trigger
        elif entry.kind == Kind.INPUT and (entry.noun, entry.owner) == (received.TOPIC.noun, owner):
            trigger = entry.sequence
        else:
            trigger = None
    return made


def consumed(recording: Recording, node: str, received: type[Message]) -> set[int]:
    """Sequence numbers of the inputs of one class, of its own vehicle, that a node took."""
    wanted = received.TOPIC.noun, node.partition("/")[0]
    entries = _entries(recording, node)
    return {e.sequence for e in entries if e.kind == Kind.INPUT and (e.noun, e.owner) == wanted}


def _entries(recording: Recording, node: str) -> Iterator[Entry]:
    """Entries of one node, in order."""
    for message in recording.messages([Journal]):
        payload = message.payload
        assert isinstance(payload, Journal)
        if node in payload.names:
            yield from (entry for entry in read_entries(payload) if entry.node == node)
