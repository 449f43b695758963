"""The recorder as a process of its own, under load and killed: what is lost, and what it costs.

The load is what a recorded flight published, over and over under the names of four mock-ups, each a process
with its own session as in a run, and pictures of two star cameras. Lost is what was published after the
recorder was ready and before it was asked to end, and is not in the file.
"""

import heapq
import itertools
import multiprocessing
import os
import random
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.context import ForkServerProcess
from multiprocessing.synchronize import Event
from operator import itemgetter
from pathlib import Path

import numpy as np

from bench.limits import at_most
from bench.processes import read
from bench.rows import RIGS, ROOT, Bench, Row
from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.declarations.topic import Topic
from groundstation.launch import recorder as recorder_process
from groundstation.launch.orders import Orders
from groundstation.parts.stars.messages import StarImage
from groundstation.parts.table import installed_tables
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover
from groundstation.recording.run_files import part_of
from groundstation.recording.writer import Recorder

PAYLOADS = installed_tables().payloads
SOURCE = ROOT / "tests" / "replay" / "recordings" / "formation.mcap"
VEHICLES = ("alpha", "beta", "gamma", "delta")
WITH_CAMERA = VEHICLES[:2]
BATCH_S = 0.05
PICTURE_HZ = 15.0
IMU_HZ = 250.0
OF_EACH_SAMPLE = ("imu_bytes", "imu_raw", "imu", "state")
KILLS = 20
JUMPS = 20
SHOWN_NS = 100_000_000
MOST_JUMP_S, AIM_JUMP_S = 1.0, 0.3
MOST_LOST_S = 0.3
MOST_CORE, AIM_CORE = 0.12, 0.06
READY_S = 120.0
FORKS = multiprocessing.get_context("forkserver")
"""Processes start as those of a run do: forked from one that has loaded everything."""
FORKS.set_forkserver_preload([__name__, "groundstation.launch.recorder"])


def measure(bench: Bench) -> list[Row]:
    """Rows for the load, for the kills, and for jumping in an hour's recording."""
    seconds = 60.0 * bench.live_minutes
    return [*_loaded(bench, seconds), _killed(bench), _hour(bench)]


def _hour(bench: Bench) -> Row:
    path = bench.folder / "hour.mcap"
    bench.say("recorder: writing an hour's recording")
    with Recording(SOURCE) as source, Recorder(path, source.info) as recorder:
        period_ns = source.stop_ns - source.start_ns + 1
        flight = list(source.messages(PAYLOADS.values()))
        for lap in range(round(3600e9 / period_ns)):
            for message in flight:
                at_ns = message.log_ns + lap * period_ns
                envelope = message.envelope._replace(publish_ns=at_ns)
                recorder.record_encoded(PAYLOADS[envelope.topic.noun], envelope, message.data, at_ns)
    bench.say("recorder: jumping in it")
    opened_s, jumped_s = [], []
    draw = random.Random(2)
    for _ in range(JUMPS):
        begin_s = time.perf_counter()
        with Recording(path) as recording:
            opened_s.append(time.perf_counter() - begin_s)
            at_ns = round(draw.uniform(recording.start_ns, recording.stop_ns))
            begin_s = time.perf_counter()
            recording.newest(PAYLOADS.values(), at_ns)
            for _ in recording.messages(PAYLOADS.values(), start_ns=at_ns, stop_ns=at_ns + SHOWN_NS):
                pass
            jumped_s.append(time.perf_counter() - begin_s)
    return at_most(
        "an hour's recording, two mock-ups: a moment anywhere, the newest of every topic and the next 0.1 s",
        max(jumped_s),
        MOST_JUMP_S,
        AIM_JUMP_S,
        "s",
        f"the first one after opening, worst of {JUMPS}; opening {max(opened_s):.3f} s; "
        f"{path.stat().st_size / 1e6:.0f} MB",
    )


def _loaded(bench: Bench, seconds: float) -> list[Row]:
    path = bench.folder / "load.mcap"
    bench.say(f"recorder: {seconds:g} s of four mock-ups and two cameras")
    with _recording(path) as recorder, _publishing(recorder.endpoint) as sent:
        begin_s, begin_cpu_s = time.monotonic(), cpu_s(recorder.pid)
        time.sleep(seconds)
        took_s, used_s = time.monotonic() - begin_s, cpu_s(recorder.pid) - begin_cpu_s
        counts = sent()
        time.sleep(1.0)
        recorder.end()
    lost, total = _lost(path, counts)
    what = f"recorder, four mock-ups at 250 Hz and two cameras at {PICTURE_HZ:g} Hz, {seconds / 60.0:g} min"
    size = path.stat().st_size / took_s / 1e6
    note = f"of {total} messages, {total / took_s:.0f} a second, {size:.2f} MB/s"
    return [
        at_most(f"{what}: messages lost", lost, 0, note=note),
        at_most(f"{what}: CPU", used_s / took_s, MOST_CORE, AIM_CORE, "core"),
    ]


def _killed(bench: Bench) -> Row:
    lost_s, recovered = [], 0
    draw = random.Random(1)
    for number in range(KILLS):
        bench.say(f"recorder: kill -9, {number + 1} of {KILLS}")
        path = bench.folder / f"killed_{number}.mcap"
        with _recording(path) as recorder, _publishing(recorder.endpoint, WITH_CAMERA, with_pictures=False):
            time.sleep(draw.uniform(1.5, 3.0))
            killed_ns = time.monotonic_ns()
            os.kill(recorder.pid, signal.SIGKILL)
            recorder.process.join()
        found = recover(part_of(path), path)
        recovered += found.messages > 0 and not found.orphans
        lost_s.append(_missing_s(path, killed_ns))
    return at_most(
        f"recorder, kill -9, {KILLS} times: before the kill, of the worst stream",
        max(lost_s),
        MOST_LOST_S,
        unit="s",
        note=f"median {float(np.median(lost_s)):.3f} s; recovered {recovered} of {KILLS}",
    )


@dataclass
class Running:
    """A recorder's process and the hub's address."""

    process: ForkServerProcess
    endpoint: str

    @property
    def pid(self) -> int:
        """Of the process."""
        assert self.process.pid is not None
        return self.process.pid

    def end(self) -> None:
        """Ask it to end, and wait until it has."""
        self.process.terminate()
        self.process.join(READY_S)
        if self.process.exitcode:
            raise RuntimeError(f"the recorder ended with code {self.process.exitcode}")


@contextmanager
def _recording(path: Path) -> Iterator[Running]:
    rig = RIGS / "drawn_fixes.toml"
    text = rig.read_text(encoding="utf-8") + '\n[record]\nimages = "lossless"\n'
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with ZenohBus(endpoint, is_hub=True) as hub:
        ready = hub.collect("record/recorder", 4)
        orders = Orders("recorder", rig, text, endpoint, recording=path)
        process = FORKS.Process(target=record, args=(orders,), daemon=True)
        process.start()
        try:
            _wait(lambda: bool(ready.take()), process)
            yield Running(process, endpoint)
        finally:
            process.kill()
            process.join()


def record(orders: Orders) -> None:
    """Run the recorder as its launcher would: its stdin stays open."""
    reading, writing = os.pipe()
    sys.stdin = os.fdopen(reading)
    del writing
    recorder_process.main(orders)


def _wait(is_there: Callable[[], bool], process: ForkServerProcess) -> None:
    until_s = time.monotonic() + READY_S
    while not is_there():
        if process.exitcode is not None or time.monotonic() > until_s:
            raise RuntimeError("the recorder did not start")
        time.sleep(0.02)


@contextmanager
def _publishing(
    endpoint: str, vehicles: tuple[str, ...] = VEHICLES, *, with_pictures: bool = True
) -> Iterator[Callable[[], dict[tuple[str, str], int]]]:
    """Publish until the end; the function given stops it and tells how much was sent, by noun and owner."""
    stop, results = FORKS.Event(), FORKS.Queue()
    begun = [FORKS.Event() for _ in vehicles]
    flyers = [
        FORKS.Process(
            target=fly,
            args=(endpoint, name, with_pictures and name in WITH_CAMERA, event, stop, results),
            daemon=True,
        )
        for name, event in zip(vehicles, begun, strict=True)
    ]
    for flyer in flyers:
        flyer.start()

    def ended() -> dict[tuple[str, str], int]:
        stop.set()
        counts: dict[tuple[str, str], int] = {}
        for _ in flyers:
            counts |= results.get(timeout=READY_S)
        return counts

    try:
        for event in begun:
            if not event.wait(READY_S):
                raise RuntimeError("a process of the load did not start")
        yield ended
    finally:
        stop.set()
        for flyer in flyers:
            flyer.join(READY_S)


def fly(endpoint: str, vehicle: str, has_camera: bool, begun: Event, stop: Event, results: object) -> None:
    """Publish what one vehicle of the source published, over and over, in batches as its process would."""
    pieces = _source()
    counts: dict[tuple[str, str], int] = {}
    pictures = _pictures(vehicle) if has_camera else []
    picture_ns = round(1e9 / PICTURE_HZ)
    with ZenohBus(endpoint) as bus:
        begun.set()
        begin_ns = time.monotonic_ns()
        queue = heapq.merge(*(_laps(begin_ns, *piece) for piece in pieces), key=itemgetter(0))
        following, picture = next(queue), 0
        while not stop.is_set():
            time.sleep(BATCH_S)
            now_ns = time.monotonic_ns()
            batch = RecordWriter()
            while following[0] <= now_ns:
                at_ns, topic, data = following
                counts[topic.noun, vehicle] = sequence = counts.get((topic.noun, vehicle), 0) + 1
                batch.add(Envelope(topic, vehicle, sequence, at_ns), data)
                following = next(queue)
            while pictures and begin_ns + picture * picture_ns <= now_ns:
                topic = StarImage.TOPIC
                counts[topic.noun, vehicle] = sequence = counts.get((topic.noun, vehicle), 0) + 1
                data = pictures[picture % len(pictures)]
                batch.add(Envelope(topic, vehicle, sequence, begin_ns + picture * picture_ns), data)
                picture += 1
            bus.publish_batch(f"{vehicle}_flight", batch.take())
    results.put(counts)  # type: ignore[attr-defined]  # a queue of the starting context


Flown = list[tuple[int, Topic, bytes]]
"""Messages: nanoseconds since the beginning, topic, payload."""


def _laps(begin_ns: int, messages: Flown, period_ns: int) -> Iterator[tuple[int, Topic, bytes]]:
    """The same over and over."""
    for lap in itertools.count():
        for at_ns, topic, data in messages:
            yield begin_ns + lap * period_ns + at_ns, topic, data


def _source() -> list[tuple[Flown, int]]:
    """What one vehicle published, and its length: what each sample of the IMU brings, at 250 Hz; the rest."""
    kinds = [kind for kind in PAYLOADS.values() if not kind.TOPIC.latched]
    with Recording(SOURCE) as recording:
        vehicle = next(c.owner for c in recording.channels if c.noun == "state")
        found = [
            (message.log_ns - recording.start_ns, message.envelope.topic, message.data)
            for message in recording.messages(kinds, [vehicle])
        ]
        period_ns = recording.stop_ns - recording.start_ns + 1
    samples = sum(topic.noun == "imu" for _, topic, _ in found)
    faster = IMU_HZ * period_ns * 1e-9 / samples
    quick = [(round(at_ns / faster), *rest) for at_ns, *rest in found if rest[0].noun in OF_EACH_SAMPLE]
    return [
        (quick, round(period_ns / faster)),
        ([row for row in found if row[1].noun not in OF_EACH_SAMPLE], period_ns),
    ]


def _pictures(vehicle: str) -> list[bytes]:
    """Dark pictures with noise and some lights, as a star camera gives them."""
    draw = np.random.default_rng(len(vehicle))
    found = []
    for _ in range(8):
        image = draw.normal(12.0, 1.5, (480, 640)).clip(0, 255).astype(np.uint8)
        for v, u in draw.integers(8, 470, (20, 2)).tolist():
            image[v : v + 3, u : u + 3] = 200
        picture = StarImage(0, vehicle, 0, 480, 640, "mono8", 640, image.tobytes())
        found.append(codec_of(StarImage).encode(picture))
    return found


def _lost(path: Path, sent: dict[tuple[str, str], int]) -> tuple[int, int]:
    """How many are not in the file, or there twice; and how many there should be."""
    with Recording(path) as recording:
        held = {(channel.noun, channel.owner): channel.count for channel in recording.channels}
    return sum(abs(count - held.get(name, 0)) for name, count in sent.items()), sum(sent.values())


def _missing_s(path: Path, killed_ns: int) -> float:
    """From the newest message of the vehicle that lost most until the kill.

    Of any topic: what was flown before begins anew every few seconds, without a state for its first moments.
    """
    newest_ns: dict[str, int] = {}
    with Recording(path) as recording:
        for message in recording.newest(PAYLOADS.values(), 1 << 63):
            owner, at_ns = message.envelope.owner, message.envelope.publish_ns
            newest_ns[owner] = max(at_ns, newest_ns.get(owner, 0))
    return max((killed_ns - newest_ns[name]) * 1e-9 for name in WITH_CAMERA)


def cpu_s(pid: int) -> float:
    """CPU seconds of a process so far."""
    fields = read(pid, "stat").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
