"""Stop pressed to the first CAN frame that carries it: two mock-ups live, other processes load every core.

The first press comes in flight, the others on the ground, released in between: the path is the same one.
"""

import os
import time
from pathlib import Path

import numpy as np

from bench.flying import flying, load
from bench.rows import RIGS, Bench, Row
from drivers.valve_bus import messages as bus
from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.protocol import decode
from groundstation.launch.asking import ask_each
from groundstation.launch.running import RunningRig
from groundstation.launch.stop_button import stop_button
from groundstation.parts.supervision.messages import StopPress
from groundstation.parts.valves.messages import CanOut
from groundstation.recording.reader import Recording

RIG = RIGS / "two_mock_ups.toml"
PRESSES = 40
LIMIT_MS, AIM_MS = 20.0, 8.0
BETWEEN_S = 0.4
AUTHOR = "bench"


def measure(bench: Bench) -> list[Row]:
    """Press with idle and with loaded cores, then read the recordings."""
    return [
        _row(bench, "the machine else idle", loads=0, is_judged=False),
        _row(bench, "another process loads each core", loads=os.cpu_count() or 1, is_judged=True),
    ]


def _row(bench: Bench, what: str, *, loads: int, is_judged: bool) -> Row:
    path = bench.folder / f"stop_{loads}.mcap"
    with flying(bench, RIG, "--record", str(path)) as flight:
        flight.wait_for(r"(\w+): flying", {"alpha", "beta"})
        run = flight.rig
        with load(loads):
            _press(bench, run, what)
    found_ms = np.array(ages_ms(path))
    p50, p99 = np.percentile(found_ms, (50, 99))
    return Row(
        f"stop pressed to the first CAN frame that carries it, live, p99; {what}",
        f"{LIMIT_MS:g} ms (aim {AIM_MS:g})" if is_judged else "",
        f"{p99:.1f} ms (p50 {p50:.1f} ms, most {found_ms.max():.1f} ms, {len(found_ms)} frames)",
        bool(p99 <= LIMIT_MS and len(found_ms) == PRESSES * len(run.vehicles)) if is_judged else None,
    )


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


def ages_ms(path: Path, *, first_only: bool = True) -> list[float]:
    """Of each press that changed something, per vehicle, its first stop frame.

    Args:
        path: Recording of the flight.
        first_only: The second press only shortened the first one: it is left out.
    """
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
    if first_only:
        begins_ns = [begins_ns[0], *begins_ns[2:]]
    found_ms = []
    for stamps_ns in frames.values():
        for begin_ns in begins_ns:
            after = [stamp_ns for stamp_ns in stamps_ns if stamp_ns >= begin_ns]
            if after:
                found_ms.append((min(after) - begin_ns) * 1e-6)
    return found_ms
