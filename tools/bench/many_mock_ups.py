"""Many mock-ups in one process: one flight recorded under many names, and its replay timed.

What a mock-up's IMU reader and fusion heard and said in a lockstep flight is written again for every name;
bytes, samples, late fixes, states and journal are all there, so the replay runner does for each mock-up what
it does for one: decode, call the nodes, compare every payload bit for bit.
"""

import time
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path

from bench.limits import at_most
from bench.rows import RIGS, Bench, Row
from groundstation.bus.envelope import Delivered
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.rig import Rig
from groundstation.declarations.topic import Scope
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.table import installed_tables
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder
from groundstation.rig.plan import make_node
from groundstation.rig.read import load_rig, parse_rig, read_text
from groundstation.runners.replay import ReplayRunner

ORIGINAL = "alpha"
NODES = ("imu_reader", "fusion")
CASES = ((20, 4), (5, 1))
"""Mock-ups, polls of 1 kHz per IMU frame."""
FLOWN_S = 16.0
REPEATS = 3
MUST = 1.0
"""CPU seconds per second flown: real time on one core."""


@dataclass(frozen=True, slots=True)
class Replayed:
    """A timed replay."""

    cpu_s_per_s: float
    """CPU seconds per second flown."""
    samples: int
    is_same: bool
    """Whether every payload came out as recorded."""


def measure(bench: Bench) -> list[Row]:
    """Bytes to IMU reader to fusion with late fixes, every payload compared with the recording."""
    rows = []
    for count, averaging in CASES:
        what = (
            f"replay of {count} mock-ups at {1000 // averaging} samples/s in one process: CPU s per s flown"
        )
        bench.say(what)
        recording = bench.folder / f"{count}_mock_ups.mcap"
        names = multiply(fly(bench.folder, averaging, FLOWN_S), recording, count)
        found = [replay(recording, names) for _ in range(REPEATS)]
        middle = sorted(each.cpu_s_per_s for each in found)[REPEATS // 2]
        row = at_most(what, middle, MUST, note=f"{bench.in_units(middle)}, {found[0].samples} samples")
        same = all(each.is_same for each in found)
        rows.append(row if same else Row(what, row.limit, "the replay differs from the recording", ok=False))
    return rows


def fly(folder: Path, averaging: int, flown_s: float) -> Path:
    """Record one mock-up under the published condition (a fix each 0.65 s, 0.6 s late).

    Args:
        folder: Where rig and recording are written.
        averaging: Polls of 1 kHz per IMU frame.
        flown_s: Length.
    """
    text = (RIGS / "drawn_fixes.toml").read_text()
    text = text.replace("averaging = 10", f"averaging = {averaging}")
    text = text.replace("baud = 250000", f"baud = 250000\naveraging = {averaging}")
    rig, path = folder / f"{averaging}.toml", folder / f"{averaging}.mcap"
    rig.write_text(text)
    run_lockstep(load_rig(rig), read_text(rig), rig, path, flown_s, 1, lambda _text, _done: None)
    return path


def multiply(source: Path, target: Path, count: int) -> list[str]:
    """Write a recording of one mock-up again under ``count`` names; return the names."""
    names = [f"mock_up_{i:02d}" for i in range(count)]
    with Recording(source) as recording, Recorder(target, recording.info) as recorder:
        for message in recording.messages(installed_tables().payloads.values()):
            envelope, payload = message.envelope, message.payload
            if envelope.topic.scope is Scope.RIG:
                recorder.record(Delivered(envelope, payload), message.log_ns)
                continue
            for name in names:
                renamed = envelope._replace(owner=_renamed(envelope.owner, name))
                recorder.record(Delivered(renamed, _of(payload, name)), message.log_ns)
    return names


def replay(path: Path, names: list[str]) -> Replayed:
    """Replay IMU reader and fusion of every name, in this process."""
    with Recording(path) as recording:
        alone = parse_rig(recording.info.rig_toml, Path(recording.info.rig_path))
        rig = alone.model_copy(update={"vehicles": dict.fromkeys(names, alone.vehicles[ORIGINAL])})
        keys = [f"{name}/{node}" for name in names for node in NODES]
        begin_s = time.process_time()
        report = ReplayRunner(recording, partial(_make, rig), keys).run()
        cpu_s = time.process_time() - begin_s
        flown_s = (recording.stop_ns - recording.start_ns) * 1e-9
    samples = sum(result.equal for result in report.results if result.noun == "imu")
    return Replayed(cpu_s / flown_s, samples, report.agrees and not report.missing_inputs)


def _make(rig: Rig, key: str) -> Node:
    return make_node(rig, key)


def _of(payload: Message, name: str) -> Message:
    """The payload with every mention of the original's name or its process changed."""
    changed: dict[str, object] = {}
    for field in fields(payload):
        value = getattr(payload, field.name)
        if isinstance(value, str):
            changed[field.name] = _renamed(value, name)
        elif isinstance(value, tuple) and value and isinstance(value[0], str):
            changed[field.name] = tuple(_renamed(text, name) for text in value)
    return replace(payload, **changed)  # type: ignore[arg-type]  # names come from the class itself


def _renamed(text: str, name: str) -> str:
    """``alpha`` and ``alpha/fusion`` become the name's; the one process becomes one for each name."""
    if text == "lockstep":
        return f"{name}_flight"
    return name + text.removeprefix(ORIGINAL) if text.split("/")[0] == ORIGINAL else text
