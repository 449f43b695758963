"""On 80 by 24 characters two vehicles show mode and faults first, cut and not wrapped, and the keys."""

import io
import math
import re
import time
from types import SimpleNamespace

import pytest
from rich.console import Console

from groundstation.bus.cdr import ros_fields
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.cli.keys import HELP
from groundstation.cli.terminal_view import TerminalView
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import FixAccount, FusionStatus, VehicleState
from groundstation.parts.imu.messages import Imu
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.table import own_tables
from groundstation.parts.valves.messages import Outlook, ValveCommand, ValveSelection, ValveStatus
from groundstation.watch.monitor import Monitor

WIDTH, HEIGHT = 80, 24


def of(kind, name, **known):
    """A message of which only some fields are given; the others are zero or empty."""
    zeros = {"string": "", "bool": False}
    values = []
    for field, ros in ros_fields(kind):
        length = int(ros.partition("[")[2][:-1] or 0) if "[" in ros else None
        zero = zeros.get(ros, 0 if length is None else (0.0,) * length)
        values.append(known.get(field, b"" if ros == "uint8[]" else zero))
    return kind(time.monotonic_ns(), name, *values)


def flown(name):
    """What an ordinary flight publishes for the view."""
    return (
        of(ValveStatus, name, pressure_pa=1.8e7, floating=True, open_mask=5),
        of(ValveCommand, name, gate="open"),
        of(ValveSelection, name, source="controller"),
        of(Outlook, name, stopping_distance_m=0.01, time_to_edge_s=math.inf),
        of(VehicleState, name, position_table_m=(-1.234, 0.987), heading_rad=3.0, status="flying"),
        of(ControlStatus, name, goal_position_table_m=(-1.23, 0.98), goal_heading_rad=3.0),
        of(FusionStatus, name, fixes_used=1234, fixes_refused=7, fix_age_s=0.05),
        of(FixAccount, name, used=False, reason="gate", nis=17.0, innovation=(0.001, 0.001, 0.01)),
        of(Imu, name),
    )


def screen_of(vehicles, width=WIDTH, height=HEIGHT, keys=HELP, more=()):
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
        for message in flown(name) if name in more else ():
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
    assert any(line.strip().startswith("tank") for line in screen_of(("alpha", "beta"), more=("alpha",)))


def label_of(line):
    return re.split(r"\s{2,}", line.strip())[0]


def test_rows_that_nothing_is_published_for_give_way_to_others():
    lines = screen_of(("alpha", "beta"), more=("alpha", "beta"))
    labels = [label_of(line) for line in lines]
    for label in ("injected", "refused", "thrust, learned"):
        assert label not in labels
    for label in ("mode", "faults", "tank", "position, heading", "star fixes", "innovation, NIS", "not used"):
        assert label in labels
    assert len(lines) <= HEIGHT


def test_a_row_stays_while_one_of_the_vehicles_has_something_there():
    lines = screen_of(("alpha", "beta"), more=("beta",))
    assert "tank" in [label_of(line) for line in lines]


def test_where_there_is_room_every_row_is_there():
    labels = [label_of(line) for line in screen_of(("alpha", "beta"), 160, 60)]
    assert {"injected", "refused", "tank"} <= set(labels)


def test_numbers_move_together_before_they_are_cut_off():
    position = next(
        line
        for line in screen_of(("alpha", "beta"), more=("alpha", "beta"))
        if label_of(line) == "position, heading"
    )
    assert position.count("-1234.0 987.0 mm 171.89") == 2


def test_the_newest_event_and_the_keys_are_on_it():
    lines = screen_of(("alpha", "beta"))
    assert any("event 11" in line for line in lines)
    assert lines[-1] == HELP
    assert "Ctrl-C ends" in screen_of(("alpha", "beta"), keys="")[-1]


def test_what_is_left_out_is_the_lower_part_and_it_is_there_where_there_is_room():
    assert not any("processes" in line for line in screen_of(("alpha", "beta"), more=("alpha",)))
    assert any("processes" in line for line in screen_of(("alpha", "beta"), 120, 50))


@pytest.mark.parametrize("height", [10, 12, 16, 20, 24, 30, 40])
def test_any_height_shows_mode_and_faults(height):
    lines = screen_of(("alpha", "beta"), WIDTH, height)
    assert len(lines) <= height
    assert any("braking" in line for line in lines)
    assert any("star_outage" in line for line in lines)
