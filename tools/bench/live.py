"""Two mock-ups live: frames lost, age of the state, age of the fix; from the recording of the whole run.

The age of the state once more in a second run, beside a process that loads one core.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bench.journal_of import consumed, made_from
from bench.rows import RIGS, ROOT, Bench, Row
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.imu.messages import Imu, ImuBytes
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.stars.sections import StarsOfType
from groundstation.recording.reader import Recorded, Recording
from groundstation.rig.read import load_rig

RIG = RIGS / "two_mock_ups.toml"
STATE_MS = (0.6, 6.0)
LOADED_STATE_MS = (2.0, 30.0)
FIX_P99_MS = 30.0
WARM_UP_S = 10.0
"""Of processes that have just started; left out of the ages, not out of the losses."""


def measure(bench: Bench) -> list[Row]:
    """Fly, then read the recording."""
    path = bench.folder / "live.mcap"
    duration_s = 60.0 * bench.live_minutes
    _fly(bench, path, duration_s)
    bench.say("live: reading the recording")
    rig = load_rig(RIG)
    with Recording(path) as recording:
        lost, frames = 0, 0
        state_ms: list[float] = []
        fix_ms: list[float] = []
        for vehicle in rig.vehicles:
            lost_here, frames_here = _lost(recording, vehicle)
            lost, frames = lost + lost_here, frames + frames_here
            state_ms += _bytes_to_state_ms(recording, vehicle)
            fix_ms += _frame_to_fix_ms(recording, vehicle, rig)
    minutes = f"{bench.live_minutes:g} min"
    fix_p50, fix_p99 = np.percentile(fix_ms, (50, 99))
    rate = _recording_rate(path)
    return [
        Row(
            f"live, two mock-ups, {minutes}: IMU frames lost between PIC and fusion",
            "0",
            f"{lost} of {frames}",
            lost == 0 and frames >= 0.97 * len(rig.vehicles) * 250.0 * duration_s,
        ),
        _state_row(f"live, {minutes}", STATE_MS, state_ms),
        _state_row(f"live, {minutes}, one core loaded", LOADED_STATE_MS, _state_ms_beside_a_load(bench, rig)),
        Row(
            f"live, {minutes}: camera frame read to fix published, p99",
            f"{FIX_P99_MS:g} ms",
            f"{fix_p99:.1f} ms (p50 {fix_p50:.1f} ms, {len(fix_ms)} fixes)",
            bool(fix_p99 <= FIX_P99_MS),
        ),
        Row(f"live, {minutes}: recording", "", rate, None),
    ]


def _state_row(run: str, limits_ms: tuple[float, float], ages_ms: list[float]) -> Row:
    p50, p99 = np.percentile(ages_ms, (50, 99))
    return Row(
        f"{run}: serial bytes arrived to state published, p50 / p99",
        f"{limits_ms[0]:g} / {limits_ms[1]:g} ms",
        f"{p50:.2f} / {p99:.2f} ms ({len(ages_ms)} states)",
        bool(p50 <= limits_ms[0] and p99 <= limits_ms[1]),
    )


def _state_ms_beside_a_load(bench: Bench, rig: Rig) -> list[float]:
    """Ages of the states of a run beside a process that never rests."""
    path = bench.folder / "live_loaded.mcap"
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as load:
        try:
            _fly(bench, path, 60.0 * bench.live_minutes)
        finally:
            load.kill()
    with Recording(path) as recording:
        return [age for vehicle in rig.vehicles for age in _bytes_to_state_ms(recording, vehicle)]


def _fly(bench: Bench, path: Path, duration_s: float) -> None:
    words = [
        "run",
        str(RIG),
        "--headless",
        "--no-console",
        "--duration",
        str(duration_s),
        "--record",
        str(path),
    ]
    command = [sys.executable, "-m", "groundstation", *words]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            bench.say(f"live: {line.strip()[:100]}")
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)} ended with code {process.returncode}")


def _messages(recording: Recording, kind: type[Message], vehicle: str) -> Iterator[Recorded]:
    return recording.messages([kind], [vehicle])


def _lost(recording: Recording, vehicle: str) -> tuple[int, int]:
    """Frames that the ticks miss or that fusion never took, and frames seen."""
    taken = consumed(recording, f"{vehicle}/fusion", Imu)
    missing_ticks = 0
    reported: list[int] = []
    before: Imu | None = None
    for message in _messages(recording, Imu, vehicle):
        sample = message.payload
        assert isinstance(sample, Imu)
        if before is not None:
            window = round(sample.window_s * 1e3)
            missing_ticks += round((sample.tick_ms - before.tick_ms) / window) - 1
        before = sample
        reported.append(message.envelope.sequence)
    journaled = max(taken, default=0)  # the last journal of a process may miss its last samples
    never_taken = sum(sequence not in taken for sequence in reported if sequence <= journaled)
    return missing_ticks + never_taken, len(reported)


def _bytes_to_state_ms(recording: Recording, vehicle: str) -> list[float]:
    sample_of_state = made_from(recording, f"{vehicle}/fusion", Imu, VehicleState)
    read_of_sample = made_from(recording, f"{vehicle}/imu_reader", ImuBytes, Imu)
    arrived = {x.envelope.sequence: x.payload.stamp_ns for x in _messages(recording, ImuBytes, vehicle)}
    begin_ns = recording.start_ns + round(WARM_UP_S * 1e9)
    ages_ms = []
    for message in _messages(recording, VehicleState, vehicle):
        read = read_of_sample.get(sample_of_state.get(message.envelope.sequence, 0))
        if read in arrived and arrived[read] >= begin_ns:
            ages_ms.append((message.envelope.publish_ns - arrived[read]) * 1e-6)
    return ages_ms


def _frame_to_fix_ms(recording: Recording, vehicle: str, rig: Rig) -> list[float]:
    """A frame's arrival is its stamp, the middle of the exposure, plus the rig's delay."""
    camera = rig.of_type(vehicle, StarsOfType).star_camera
    assert camera is not None
    delay_ns = round(camera.delay[0] * 1e9)
    begin_ns = recording.start_ns + round(WARM_UP_S * 1e9)
    ages_ms = []
    for message in _messages(recording, StarFix, vehicle):
        fix = message.payload
        assert isinstance(fix, StarFix)
        arrived_ns = fix.stamp_ns + delay_ns
        if fix.fix and arrived_ns >= begin_ns:
            ages_ms.append((message.envelope.publish_ns - arrived_ns) * 1e-6)
    return ages_ms


def _recording_rate(path: Path) -> str:
    with Recording(path) as recording:
        span_s = (recording.stop_ns - recording.start_ns) * 1e-9
    return f"{path.stat().st_size / span_s / 1e3:.0f} kB/s"
