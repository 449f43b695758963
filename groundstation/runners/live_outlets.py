"""What leaves a live process: a message at once where somebody subscribes, all in the record stream."""

import sys
from collections.abc import Callable
from dataclasses import dataclass

import zenoh

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import TopicPublisher, ZenohBus
from groundstation.declarations.message import Message
from groundstation.declarations.topic import Pace, Topic
from groundstation.recording.policy import ImagePolicy, is_kept
from groundstation.runners.record_sender import RecordSender
from groundstation.runners.witness import Witness

RECORD_PERIOD_NS = 50_000_000
RECORD_BYTES = 1 << 20
"""A batch is sent at the latest when it has this size."""


@dataclass(slots=True)
class _Outlet:
    """Where a topic of an owner goes from here.

    Attributes:
        publisher: On its own key.
        paced: On the key of those who take it paced; None where nobody may.
        pace: Of that key.
        encode: To CDR.
        is_kept: Whether it goes into the record stream.
    """

    publisher: TopicPublisher
    paced: TopicPublisher | None
    pace: Pace
    encode: Callable[[Message], bytes]
    is_kept: bool


class LiveOutlets:
    """Sends what a process publishes; one thread.

    Args:
        bus: Session with the hub.
        process: Its name.
        images: What of the cameras is recorded.
        on_loss: Called once when the hub is gone; nothing is sent after that.
        apart: Session of the topics that come apart; None where none is published here.
    """

    def __init__(
        self,
        bus: ZenohBus,
        process: str,
        images: ImagePolicy,
        on_loss: Callable[[], None],
        apart: ZenohBus | None = None,
    ) -> None:
        self._bus = bus
        self._apart = apart
        self._images = images
        self._on_loss = on_loss
        self._outlets: dict[tuple[str, str], _Outlet] = {}
        self._latched: dict[tuple[str, str], tuple[Envelope, bytes]] = {}
        self._record = RecordWriter()
        self._sender = RecordSender(bus, process)
        self._witness = Witness()
        self._flush_due_ns = 0
        self._hub_is_gone = False

    @property
    def due_ns(self) -> int | None:
        """When ``flush`` is to be called; None while nothing waits."""
        return self._flush_due_ns if len(self._record) else None

    def send(self, delivered: Delivered) -> None:
        """Put a message into the record stream, and on its own key where somebody subscribes."""
        envelope, payload = delivered
        topic, owner = envelope[:2]
        outlet = self._outlets.get((topic.noun, owner))
        if outlet is None:
            outlet = self._outlets[topic.noun, owner] = self._open(topic, owner, type(payload))
        wanted = []
        if outlet.publisher.is_wanted:
            wanted.append(outlet.publisher)
        if outlet.paced is not None and outlet.pace.passes(envelope.publish_ns) and outlet.paced.is_wanted:
            wanted.append(outlet.paced)
        if not (outlet.is_kept or wanted):
            return
        encoded = outlet.encode(payload)
        for publisher in wanted:
            self._put(publisher, envelope, encoded)
        if topic.latched:
            self._latched[topic.noun, owner] = envelope, encoded
        if outlet.is_kept:
            self._record.add(envelope, encoded)

    def repeat_latched(self) -> None:
        """For late joiners, of the topics and of the record stream."""
        for key, (envelope, encoded) in self._latched.items():
            publisher = self._outlets[key].publisher
            if publisher.is_wanted:
                self._put(publisher, envelope, encoded)
            self._record.add(envelope, encoded)

    def witness(self, envelope: Envelope, encoded: bytes) -> None:
        """Keep what another process published, for the case that it dies."""
        if is_kept(envelope.topic, self._images):
            self._witness.keep(envelope, encoded)

    def testify(self) -> None:
        """A process died: record what was received of the others in the last moments."""
        self._witness.testify(self._record)

    def flush(self, now_ns: int) -> None:
        """Send the record stream's batch if it is due, or large."""
        if now_ns >= self._flush_due_ns or self._record.size > RECORD_BYTES:
            self._flush(now_ns)

    def close(self, now_ns: int) -> None:
        """Send what waits."""
        self._flush(now_ns)
        self._sender.close()

    def _open(self, topic: Topic, owner: str, kind: type[Message]) -> _Outlet:
        bus = self._apart if topic.is_apart and self._apart is not None else self._bus
        return _Outlet(
            bus.publisher(topic, owner),
            self._bus.publisher(topic, owner, paced=True) if topic.pace_ns else None,
            Pace(topic.pace_ns),
            codec_of(kind).encode,
            is_kept(topic, self._images),
        )

    def _put(self, publisher: TopicPublisher, envelope: Envelope, encoded: bytes) -> None:
        """Hand to the bus; the loop goes on without it, since valves and ports are closed from here."""
        if self._hub_is_gone:
            return
        try:
            publisher.put(encoded, envelope.attachment())
        except zenoh.ZError as error:
            self._lose_hub(str(error))

    def _flush(self, now_ns: int) -> None:
        self._flush_due_ns = now_ns + RECORD_PERIOD_NS
        if len(self._record):
            self._sender.send(self._record)
        if self._sender.is_broken:
            self._lose_hub("the record stream cannot be sent")

    def _lose_hub(self, why: str) -> None:
        if not self._hub_is_gone:
            self._hub_is_gone = True
            sys.stderr.write(f"the hub is gone, ending: {why}\n")
            self._on_loss()
