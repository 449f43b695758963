"""How a live process begins: it remembers first, then bus and other ports are let in; a stop overtakes."""

import json
import queue
import socket
import threading
import time
from dataclasses import dataclass

import pytest

from drivers.errors import DeviceError
from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.journal import Journal, JournalWriter, Kind, read_entries
from groundstation.bus.listener import Listener
from groundstation.bus.record_stream import read_batch
from groundstation.bus.zenoh_bus import RECORD, ZenohBus
from groundstation.declarations.node import Node
from groundstation.declarations.port import Edge, Port
from groundstation.declarations.request import Request
from groundstation.launch.asking import publish
from groundstation.launch.stop_button import StopButton
from groundstation.parts.supervision.memory import MemoryPort
from groundstation.parts.supervision.messages import Recalled, StopPress, Supervision
from groundstation.recording.policy import ImagePolicy
from groundstation.runners.live import LiveProcess
from groundstation.runners.slot import Sequences, Slot

PAYLOADS = {kind.TOPIC.noun: kind for kind in (Recalled, StopPress, Supervision, Request, Journal)}
JUNK = 10_000


def ruling(now_ns, mode, *, latched=False):
    return Supervision(
        now_ns, "alpha", mode, "closed", False, False, latched, 0.0, False, 0, "", "", now_ns, (), ()
    )


class Supervisor(Node):
    """Notes what reaches it and in which order; a request takes it as long as a slow node."""

    inputs = (StopPress, Request, Recalled)
    outputs = (Supervision,)

    def __init__(self, request_s=0.0):
        super().__init__("alpha")
        self.seen = []
        self._request_s = request_s
        self.stopped = threading.Event()

    def sources(self, payload):
        return ("alpha", "")

    def start(self, now_ns):
        self.seen.append("start")
        yield ruling(now_ns, "resting")

    def receive(self, message, now_ns):
        self.seen.append(type(message).__name__)
        if isinstance(message, StopPress):
            self.stopped.set()
            yield ruling(now_ns, "braking", latched=True)
        elif isinstance(message, Recalled):
            mode = json.loads(message.content)["mode"] if message.content else "resting"
            yield ruling(now_ns, mode, latched=mode == "stopped")
        else:
            time.sleep(self._request_s)


@pytest.fixture
def endpoint():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def hub(endpoint):
    with ZenohBus(endpoint, is_hub=True) as bus:
        yield bus


class Running:
    """A live process in a thread."""

    def __init__(self, endpoint, node, ports=()):
        self._bus, self._apart = ZenohBus(endpoint), ZenohBus(endpoint)
        journal, sequences = JournalWriter(), Sequences()
        slot = Slot("alpha/supervisor", node, "commands", journal, sequences, measure=False)
        self.process = LiveProcess(
            "commands", [slot], ports, self._bus, PAYLOADS, journal, sequences,
            images=ImagePolicy.OFF, apart=self._apart,
        )  # fmt: skip
        self._thread = threading.Thread(target=self.process.run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self.process.stop()
        self._thread.join()
        self._bus.close()
        self._apart.close()


def ready(hub):
    """Set when the process is."""
    event = threading.Event()
    hub.watch(lambda name, alive: event.set() if (name, alive) == ("commands", True) else None)
    return event


def test_what_was_kept_is_delivered_and_journaled_before_anything_else(hub, endpoint, tmp_path):
    (tmp_path / "alpha.json").write_text(json.dumps({"mode": "stopped"}))
    batches = queue.SimpleQueue()
    hub.subscribe(f"{RECORD}/*", lambda _key, batch, _attachment: batches.put(batch))
    node, is_ready = Supervisor(), ready(hub)
    port = MemoryPort("alpha/memory", "alpha", tmp_path)
    with Running(endpoint, node, [port]):
        assert is_ready.wait(5.0)
        assert node.seen == ["start", "Recalled"]
        assert json.loads((tmp_path / "alpha.json").read_text())["mode"] == "stopped"
    recorded = []
    while not batches.empty():
        recorded += read_batch(batches.get())
    journals = [codec_of(Journal).decode(entry.data) for entry in recorded if entry.noun == "journal"]
    entries = [entry for journal in journals for entry in read_entries(journal)]
    kinds = [(kind, noun) for _, kind, key, noun, *_ in entries if key == "alpha/supervisor"]
    assert kinds[:4] == [
        (Kind.START, ""), (Kind.OUTPUT, "supervision"), (Kind.INPUT, "recalled"),
        (Kind.OUTPUT, "supervision"),
    ]  # fmt: skip


def test_the_ruling_of_a_start_replaces_nothing_that_was_kept(hub, endpoint, tmp_path):
    kept = json.dumps({"mode": "stopped"})
    (tmp_path / "alpha.json").write_text(kept)

    @dataclass(frozen=True)
    class Watched(MemoryPort):
        def open(self):
            edge = super().open()
            written, write = self.__dict__.setdefault("written", []), edge.write
            edge.write = lambda data: (written.append(json.loads(data)["mode"]), write(data))
            return edge

    port, is_ready = Watched("alpha/memory", "alpha", tmp_path), ready(hub)
    with Running(endpoint, Supervisor(), [port]):
        assert is_ready.wait(5.0)
    assert port.written
    assert set(port.written) == {"stopped"}


def test_a_ruling_is_kept_before_anybody_receives_it(hub, endpoint, tmp_path):
    found = queue.SimpleQueue()

    def take(_key, payload, _attachment):
        if codec_of(Supervision).decode(payload).stop_latched:
            found.put(json.loads((tmp_path / "alpha.json").read_text())["mode"])

    hub.subscribe("alpha/supervision", take)
    is_ready = ready(hub)
    with (
        Running(endpoint, Supervisor(), [MemoryPort("alpha/memory", "alpha", tmp_path)]),
        ZenohBus(endpoint) as bus,
    ):
        assert is_ready.wait(5.0)
        StopButton(bus, ("alpha",), "a").press()
        assert found.get(timeout=5.0) == "braking"


def test_a_first_port_that_cannot_be_opened_is_reported_and_the_process_goes_on(hub, endpoint):
    class Gone(Edge):
        def read(self):
            raise DeviceError("it is not there")

        def close(self):
            self.is_closed = True

    @dataclass(frozen=True)
    class GonePort(Port):
        reads = Recalled
        is_first = True

        def to_message(self, stamp_ns, data):
            raise NotImplementedError

        def open(self):
            return Gone()

    batches = queue.SimpleQueue()
    hub.subscribe(f"{RECORD}/*", lambda _key, batch, _attachment: batches.put(batch))
    node, is_ready = Supervisor(), ready(hub)
    recorded = []
    with Running(endpoint, node, [GonePort("alpha/memory", "alpha", None)]):
        assert is_ready.wait(5.0)
        while "diagnostics" not in recorded:  # it comes when the port's thread has seen the trouble
            recorded += [entry.noun for entry in read_batch(batches.get(timeout=5.0))]
    assert node.seen == ["start"]


def test_a_stop_passes_a_flood_of_requests_that_waits(hub, endpoint):
    node, is_ready = Supervisor(request_s=0.001), ready(hub)
    with Running(endpoint, node), ZenohBus(endpoint) as flood, ZenohBus(endpoint) as bus:
        assert is_ready.wait(5.0)
        encoded = codec_of(Request).encode(Request(0, "alpha", 1, "junk", "junk", "{}"))
        for sequence in range(1, JUNK + 1):
            envelope = Envelope(Request.TOPIC, "junk", sequence, time.monotonic_ns())
            flood.put(Request.TOPIC, "junk", encoded, envelope.attachment())
        before = len(node.seen)
        button = StopButton(bus, ("alpha",), "a")
        press = button.press()
        assert node.stopped.wait(2.0)
        place = node.seen.index("StopPress")
        assert place < JUNK / 2, "it waited behind the requests"
        while button.is_pending:
            button.follow()
        assert set(press.stopped) == {"alpha"}
        assert before < JUNK, "nothing waited any more: the test tests nothing"


def test_a_press_and_its_repetitions_are_one_and_each_is_recorded_apart(hub, endpoint):
    batches = queue.SimpleQueue()
    hub.subscribe(f"{RECORD}/*", lambda _key, batch, _attachment: batches.put(batch))
    with ZenohBus(endpoint) as bus:
        presses = Listener(hub, (StopPress,))
        button = StopButton(bus, ("alpha",), "a")
        press = button.press(timeout_s=0.2)
        while button.is_pending:
            button.follow()
        again = button.press(timeout_s=0.1)
    assert press.waiting == {"alpha"}
    assert again.message.press_id > press.message.press_id
    came = []
    while (delivered := presses.take(0.5)) is not None:
        came.append(delivered)
    ids = [delivered.payload.press_id for delivered in came]
    assert set(ids) == {press.message.press_id, again.message.press_id}
    assert ids.count(press.message.press_id) > 1
    sequences = [delivered.envelope.sequence for delivered in came]
    assert sequences == sorted(set(sequences)), "a replay tells them apart by their numbers"
    recorded = []
    while not batches.empty():
        recorded += [entry.sequence for entry in read_batch(batches.get())]
    assert set(sequences) <= set(recorded)


def test_a_ruling_from_before_the_press_or_of_a_flying_vehicle_acknowledges_nothing(hub, endpoint):
    with ZenohBus(endpoint) as bus, ZenohBus(endpoint) as vehicle:
        old = ruling(time.monotonic_ns(), "stopped", latched=True)
        button = StopButton(bus, ("alpha",), "a")
        press = button.press(timeout_s=0.3)
        flying = ruling(time.monotonic_ns(), "flying", latched=True)
        for number, message in enumerate((old, flying), 1):
            envelope = Envelope(Supervision.TOPIC, "alpha", number, message.stamp_ns)
            vehicle.put(
                Supervision.TOPIC, "alpha", codec_of(Supervision).encode(message), envelope.attachment()
            )
        while button.is_pending:
            button.follow()
        assert press.stopped == {}


def test_publishing_reaches_the_recorder_too(hub, endpoint):
    batches = queue.SimpleQueue()
    hub.subscribe(f"{RECORD}/*", lambda _key, batch, _attachment: batches.put(batch))
    with ZenohBus(endpoint) as bus:
        publish(bus, Request(1, "alpha", 1, "a", "land", "{}"))
        publish(bus, Request(1, "beta", 2, "a", "land", "{}"))
    entries = [entry for _ in range(2) for entry in read_batch(batches.get(timeout=5.0))]
    assert len({entry.sequence for entry in entries}) == 2
