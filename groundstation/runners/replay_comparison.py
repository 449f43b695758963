"""Compares recorded and replayed payloads, bit for bit or within tolerances that are kept as data."""

import math
import struct
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

import numpy as np

from groundstation.bus.cdr import codec_of, ros_fields
from groundstation.bus.envelope import Envelope
from groundstation.declarations.errors import UsageError
from groundstation.declarations.message import Message
from groundstation.recording.reader import Recorded
from groundstation.recording.writer import Recorder
from groundstation.runners.replay_report import Difference, TopicResult

Tolerances = Mapping[str, Mapping[str, float]]
"""Noun of a topic to field to the largest absolute difference, in the field's unit."""

EXACT: Tolerances = {}


FORGET_NS = 5_000_000_000  # recorded outputs that the journal has not claimed by then are other nodes'


class Comparison:
    """Brings together what was published then and what is published now; they come in either order.

    Args:
        tolerances: What may differ.
        output: Takes what is published now; messages published only now carry sequence 0.
    """

    def __init__(self, tolerances: Tolerances, output: Recorder | None) -> None:
        self._tolerances = tolerances
        self._output = output
        self._results: dict[tuple[str, str], TopicResult] = {}
        self._then: dict[tuple[str, str, int], Recorded] = {}
        self._now: dict[tuple[str, str, int], tuple[Message, int]] = {}
        self._log_ns = 0

    def recorded(self, message: Recorded) -> None:
        """The next message of the recording that a replayed node may have published."""
        self._log_ns = message.log_ns
        envelope = message.envelope
        key = (envelope.topic.noun, envelope.owner, envelope.sequence)
        waiting = self._now.pop(key, None)
        if waiting is not None:
            self._compare(message, waiting[0])
            return
        self._then[key] = message
        oldest = next(iter(self._then))
        if self._then[oldest].log_ns < self._log_ns - FORGET_NS:
            del self._then[oldest]

    def replayed(self, noun: str, owner: str, sequence: int, payload: Message, now_ns: int) -> None:
        """A node published this where the journal has (noun, owner, sequence)."""
        topic = payload.TOPIC
        if topic.noun != noun:
            result = self._result(noun, owner)
            result.different += 1
            result.first = result.first or Difference(sequence, payload.stamp_ns, "topic", noun, topic.noun)
            self._write(Envelope(topic, owner, 0, now_ns), payload, now_ns)
            return
        key = (noun, owner, sequence)
        message = self._then.pop(key, None)
        if message is None:
            self._now[key] = (payload, now_ns)
        else:
            self._compare(message, payload)

    def missing(self, noun: str, owner: str) -> None:
        """The journal has an output that the node did not publish."""
        self._result(noun, owner).missing += 1

    def extra(self, owner: str, payload: Message, now_ns: int) -> None:
        """The node published something that is not in the journal."""
        topic = payload.TOPIC
        self._result(topic.noun, owner).extra += 1
        self._write(Envelope(topic, owner, 0, now_ns), payload, now_ns)

    def finish(self) -> list[TopicResult]:
        """Results by noun and owner; what found no recorded partner is counted."""
        for (noun, owner, sequence), (payload, now_ns) in self._now.items():
            self._result(noun, owner).unrecorded += 1
            self._write(Envelope(payload.TOPIC, owner, sequence, now_ns), payload, now_ns)
        self._now.clear()
        return [self._results[key] for key in sorted(self._results)]

    def _compare(self, recorded: Recorded, replayed: Message) -> None:
        envelope = recorded.envelope
        result = self._result(envelope.topic.noun, envelope.owner)
        equal, found = difference(recorded, replayed, self._tolerances)
        if equal:
            result.equal += 1
        elif found is None:
            result.close += 1
        else:
            result.different += 1
            result.first = result.first or found
        self._write(envelope, replayed, recorded.log_ns)

    def _result(self, noun: str, owner: str) -> TopicResult:
        if (noun, owner) not in self._results:
            self._results[noun, owner] = TopicResult(noun, owner)
        return self._results[noun, owner]

    def _write(self, envelope: Envelope, payload: Message, log_ns: int) -> None:
        if self._output is not None:
            kind = type(payload)
            self._output.record_encoded(kind, envelope, codec_of(kind).encode(payload), log_ns)


def difference(
    recorded: Recorded, replayed: Message, tolerances: Tolerances
) -> tuple[bool, Difference | None]:
    """Compare one payload.

    Args:
        recorded: What was published then.
        replayed: What the node publishes now.
        tolerances: What may differ.

    Returns:
        Whether they are equal bit for bit, and the first difference beyond the tolerances.
    """
    if codec_of(type(replayed)).encode(replayed) == recorded.data:
        return True, None
    then = recorded.payload
    allowed = tolerances.get(replayed.TOPIC.noun, {})
    for field in fields(then):
        a, b = getattr(then, field.name), getattr(replayed, field.name)
        if _bits(a) != _bits(b) and not _close(a, b, allowed.get(field.name), field.name):
            return False, Difference(
                recorded.envelope.sequence, then.stamp_ns, field.name, _short(a), _short(b)
            )
    return False, None


def load_tolerances(path: Path, payloads: Mapping[str, type[Message]]) -> Tolerances:
    """Read tolerances: a TOML with one table per topic, ``field = largest absolute difference``.

    Args:
        path: Of the file.
        payloads: Payload classes by noun.

    Raises:
        UsageError: The file cannot be read, or names a topic or field that does not exist.
    """
    try:
        reported = tomllib.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise UsageError(f"{path}: cannot be read as tolerances ({error})") from error
    for noun, table in reported.items():
        try:
            known = dict(ros_fields(payloads[noun]))
        except KeyError:
            raise UsageError(f"{path}: {noun!r} is no topic") from None
        if not isinstance(table, dict):
            raise UsageError(f"{path}: {noun}: expected a table of fields, found {table!r}")
        for name, value in table.items():
            if not known.get(name, "").startswith("float"):
                raise UsageError(f"{path}: {noun}.{name} is no field of floating-point numbers")
            if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0:
                raise UsageError(f"{path}: {noun}.{name}: expected a number from 0 up, found {value!r}")
    return reported


def _bits(value: object) -> object:
    """Something whose equality is equality of bits: NaN equals itself, 0.0 is not -0.0."""
    if isinstance(value, float):
        return struct.pack("<d", value)
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, tuple):
        return tuple(_bits(element) for element in value)
    return value


def _close(a: object, b: object, allowed: float | None, name: str) -> bool:
    if allowed is None:
        return False
    first, second = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if first.shape != second.shape or not np.array_equal(np.isnan(first), np.isnan(second)):
        return False
    with np.errstate(invalid="ignore"):  # inf - inf: equal infinities are found by the bits
        apart = first - second
    if name.endswith("_rad"):  # an angle may have crossed the seam at pi
        apart = np.remainder(apart + math.pi, 2 * math.pi) - math.pi
    same = (first == second) | np.isnan(first)
    return bool(np.all(same | (np.abs(apart) <= allowed)))


def _short(value: object) -> str:
    text = repr(value.tolist() if isinstance(value, np.ndarray) else value)
    return text if len(text) <= 120 else f"{text[:117]}..."
