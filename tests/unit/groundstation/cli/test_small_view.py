"""On 80 by 24 characters two vehicles show mode and faults first, cut and not wrapped, and the keys."""

import io
import re
import time
from types import SimpleNamespace

import pytest
from rich.console import Console

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.cli.keys import HELP
from groundstation.cli.terminal_view import TerminalView
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.table import own_tables
from groundstation.watch.monitor import Monitor

WIDTH, HEIGHT = 80, 24


def screen_of(vehicles, width=WIDTH, height=HEIGHT, keys=HELP):
    monitor = Monitor(own_tables(), vehicles)
    now_ns = time.monotonic_ns()
    for name in vehicles:
        for message in (
            Supervision(
                now_ns, name, "braking", "brake", True, True, True, 12.0, False, 2,
                "stopped: brakes, holds, lands " + "x" * 90, "anna", now_ns, (), (),
            ),
            Faults(
                now_ns, name, ("star_outage", "low_tank"), ("No fix.", "Gas."), ("7 s", "1 bar"),
                (float(now_ns), float(now_ns)), ("flies on", "flies on"), ("Look.", "Fill."), (0.0, 0.0),
            ),
        ):  # fmt: skip
            monitor.take_delivered(Delivered(Envelope(type(message).TOPIC, name, 1, now_ns), message), now_ns)
    for number in range(12):
        monitor.note(f"event {number} " + "y" * 120)
    children = [SimpleNamespace(name=f"process_{number}", state="ready", restarts=0) for number in range(8)]
    run = SimpleNamespace(
        rig=SimpleNamespace(name="two mock-ups"),
        monitor=monitor,
        launcher=SimpleNamespace(waiting_for=[], children=children, greetings=[]),
        started_s=time.monotonic(),
    )
    out = io.StringIO()
    console = Console(file=out, width=width, height=height, force_terminal=True, color_system=None)
    view = TerminalView(run, console)
    with view.opened(headless=False, keys=keys):
        first = out.getvalue()
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", first)
    return [line.rstrip() for line in plain.replace("\r", "").split("\n")]


def test_mode_and_faults_of_both_come_before_anything_else():
    lines = screen_of(("alpha", "beta"))
    assert len(lines) <= HEIGHT
    heading = next(number for number, line in enumerate(lines) if "alpha" in line and "beta" in line)
    mode = next(number for number, line in enumerate(lines) if line.strip().startswith("mode"))
    faults = next(number for number, line in enumerate(lines) if line.strip().startswith("faults"))
    assert (heading, mode, faults) == (heading, heading + 2, heading + 3)
    assert lines[mode].count("braking (stopped") == 2
    assert lines[faults].count("star_outage") == 2
    assert all(len(line) <= WIDTH for line in lines)
    assert "\N{HORIZONTAL ELLIPSIS}" in lines[mode]


def test_gas_left_is_on_it():
    assert any(line.strip().startswith("tank") for line in screen_of(("alpha", "beta")))


def test_the_newest_event_and_the_keys_are_on_it():
    lines = screen_of(("alpha", "beta"))
    assert any("event 11" in line for line in lines)
    assert lines[-1] == HELP
    assert "Ctrl-C ends" in screen_of(("alpha", "beta"), keys="")[-1]


def test_what_is_left_out_is_the_lower_part_and_it_is_there_where_there_is_room():
    assert not any("processes" in line for line in screen_of(("alpha", "beta")))
    assert any("processes" in line for line in screen_of(("alpha", "beta"), 120, 50))


@pytest.mark.parametrize("height", [10, 12, 16, 20, 24, 30, 40])
def test_any_height_shows_mode_and_faults(height):
    lines = screen_of(("alpha", "beta"), WIDTH, height)
    assert len(lines) <= height
    assert any("braking" in line for line in lines)
    assert any("star_outage" in line for line in lines)
