"""Stop pressed to the first CAN frame that carries it: two mock-ups live, other processes load every core.

The first press comes in flight, the others on the ground, released in between: the path is the same one.
"""

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from bench.rows import RIGS, ROOT, Bench, Row
from drivers.valve_bus import messages as bus
from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.protocol import decode
from groundstation.launch.asking import ask_each
from groundstation.launch.running import RunningRig, find_running
from groundstation.launch.stop_button import stop_button
from groundstation.parts.supervision.messages import StopPress
from groundstation.parts.valves.messages import CanOut
from groundstation.recording.reader import Recording

RIG = RIGS / "two_mock_ups.toml"
PRESSES = 40
LIMIT_MS, AIM_MS = 20.0, 8.0
BETWEEN_S = 0.4
LOADING = "while True: pass"
AUTHOR = "bench"


def measure(bench: Bench) -> list[Row]:
    """Press with idle and with loaded cores, then read the recordings."""
    return [
        _row(bench, "the machine else idle", loads=0, is_judged=False),
        _row(bench, "another process loads each core", loads=os.cpu_count() or 1, is_judged=True),
    ]


def _row(bench: Bench, what: str, *, loads: int, is_judged: bool) -> Row:
    path = bench.folder / f"stop_{loads}.mcap"
    with _flying(bench, str(path)) as run, _load(loads):
        _press(bench, run, what)
    ages_ms = np.array(_ages_ms(path))
    p50, p99 = np.percentile(ages_ms, (50, 99))
    return Row(
        f"stop pressed to the first CAN frame that carries it, live, p99; {what}",
        f"{LIMIT_MS:g} ms (aim {AIM_MS:g})" if is_judged else "",
        f"{p99:.1f} ms (p50 {p50:.1f} ms, most {ages_ms.max():.1f} ms, {len(ages_ms)} frames)",
        bool(p99 <= LIMIT_MS and len(ages_ms) == PRESSES * len(run.vehicles)) if is_judged else None,
    )


@contextmanager
def _flying(bench: Bench, recording: str) -> Iterator[RunningRig]:
    """A run in which every vehicle flies."""
    command = [sys.executable, "-m", "groundstation", "run", str(RIG), "--headless", "--record", recording]
    environment = os.environ | {
        "XDG_RUNTIME_DIR": str(bench.folder),
        "XDG_STATE_HOME": str(bench.folder / "state"),
    }
    os.environ["XDG_RUNTIME_DIR"] = str(bench.folder)  # where the run is looked for
    with subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        waiting = {"alpha", "beta"}
        for line in process.stdout:
            bench.say(f"stop: {line.strip()[:100]}")
            found = re.search(r"(\w+): flying", line)
            if found is not None:
                waiting.discard(found[1])
            if not waiting:
                break
        try:
            (run,) = [run for run in find_running() if run.pid == process.pid]
            yield run
        finally:
            process.terminate()
            process.communicate()


@contextmanager
def _load(count: int) -> Iterator[None]:
    """So many processes that do nothing but compute."""
    with ExitStack() as stack:
        for _ in range(count):
            loading = stack.enter_context(subprocess.Popen([sys.executable, "-c", LOADING]))
            stack.callback(loading.kill)
        yield


def _press(bench: Bench, run: RunningRig, what: str) -> None:
    with stop_button(run.endpoint, run.vehicles, AUTHOR) as button:
        for number in range(PRESSES):
            bench.say(f"stop: {what}: press {number + 1} of {PRESSES}")
            button.press(timeout_s=10.0)
            while button.is_pending:
                button.follow()
            time.sleep(BETWEEN_S)
            if number == 0:  # in flight: a press again lands at once
                button.press(timeout_s=10.0)
                while button.is_pending:
                    button.follow()
                time.sleep(1.0)
            ask_each(run.endpoint, run.vehicles, "release", {}, AUTHOR, 10.0)
            time.sleep(BETWEEN_S * (1.0 + 0.05 * (number % 20)))  # in no step with any period


def _ages_ms(path: Path) -> list[float]:
    """Of each press that changed something, per vehicle, its first stop frame."""
    pressed: dict[int, int] = {}
    frames: dict[str, list[int]] = {}
    with Recording(path) as recording:
        for message in recording.messages([StopPress, CanOut]):
            payload, stamp_ns = message.payload, message.envelope.publish_ns
            if isinstance(payload, StopPress):
                pressed.setdefault(payload.press_id, stamp_ns)
            elif isinstance(payload, CanOut):
                reported = decode(CanFrame(payload.arbitration_id, payload.data))
                if isinstance(reported, bus.Stop):
                    frames.setdefault(payload.vehicle, []).append(stamp_ns)
    begins_ns = sorted(pressed.values())
    begins_ns = [begins_ns[0], *begins_ns[2:]]  # the second one only shortened the first
    ages_ms = []
    for stamps_ns in frames.values():
        for begin_ns in begins_ns:
            after = [stamp_ns for stamp_ns in stamps_ns if stamp_ns >= begin_ns]
            if after:
                ages_ms.append((min(after) - begin_ns) * 1e-6)
    return ages_ms
