"""The live view on terminals of several sizes, with nothing known and with everything."""

import io
import math
import re
import time
from types import SimpleNamespace

import pytest
from rich.console import Console

from groundstation.cli.terminal_view import TerminalView, text_of
from groundstation.declarations.part import Part
from groundstation.declarations.tables import Tables
from groundstation.declarations.view import Level, cell
from groundstation.parts.imu.gauges import GAUGES
from groundstation.parts.imu.messages import Imu
from groundstation.parts.operation.messages import Diagnostics, Latency
from groundstation.watch.ledger import STAGES
from groundstation.watch.monitor import Monitor

VEHICLES = ("alpha", "beta", "gamma", "delta", "epsilon")


def run_of(vehicles):
    tables = Tables((Part("imu", "", topics=(Imu, Diagnostics), gauges=GAUGES),))
    children = [
        SimpleNamespace(name="alpha_flight", state="ready", restarts=0),
        SimpleNamespace(name="alpha_sky", state="starting", restarts=2),
    ]
    launcher = SimpleNamespace(
        waiting_for=["alpha_sky"], children=children, greetings=["console: http://127.0.0.1:8400/"]
    )
    rig = SimpleNamespace(name="two mock-ups")
    monitor = Monitor(tables, vehicles)
    return SimpleNamespace(rig=rig, monitor=monitor, launcher=launcher, started_s=time.monotonic())


def drawn(run, width=120, height=50):
    screen = io.StringIO()
    console = Console(file=screen, width=width, height=height, force_terminal=True, color_system=None)
    with TerminalView(run, console).opened(headless=False):
        pass
    return screen.getvalue()


@pytest.fixture
def full():
    run = run_of(VEHICLES[:2])
    health = run.monitor.health
    health.take(Diagnostics(0, "", "valve_bus", 0, "valve_bus: open", (), ()))
    health.take(Diagnostics(0, "alpha", "alpha/imu", 2, "alpha/imu: cannot be opened", (), ()))
    ages_s = (*(0.001 * index for index in range(1, len(STAGES))), math.nan)
    run.monitor.latency["alpha"] = Latency(0, "alpha", STAGES, ages_s, tuple(2 * age for age in ages_s))
    run.monitor.note("alpha: flying")
    return run


def test_everything_is_shown(full):
    text = drawn(full)
    for words in ("two mock-ups", "waiting for alpha_sky", "IMU", "alpha", "beta", "alpha_flight", "open"):
        assert words in text
    assert "cannot be opened" in text
    assert "alpha: flying" in text
    lines = text.splitlines()
    for stage, ages in (
        ("exposure", "1.0 / 2.0"),
        ("picture arrived", "2.0 / 4.0"),
        ("in the state", "5.0 / 10.0"),
        ("on the valve bus", "8.0 / 16.0"),
        ("IMU bytes to state", "-"),
    ):
        assert any(stage in line and ages in line for line in lines), stage


def test_what_changes_is_drawn_again(full):
    screen = io.StringIO()
    view = TerminalView(full, Console(file=screen, width=120, height=50, force_terminal=True))
    with view.opened(headless=False):
        full.launcher.children[1].state = "ready"
        full.monitor.health.take(Diagnostics(0, "alpha", "alpha/imu", 2, "alpha/imu: gone", (), ()))
        before = len(screen.getvalue())
        view.refresh()
        again = screen.getvalue()[before:]
    assert "gone" in again
    assert "starting" not in again
    assert "5.0 / 10.0" in again


@pytest.mark.parametrize("size", [(80, 24), (40, 10), (200, 60)])
@pytest.mark.parametrize("vehicles", [VEHICLES[:1], VEHICLES])
def test_terminals_of_any_size_are_drawn_on(size, vehicles):
    text = drawn(run_of(vehicles), *size)
    assert "two mock-ups" in text
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)  # without what moves the cursor
    assert max(map(len, re.split(r"[\r\n]+", plain))) <= size[0]


def test_levels_become_styles_and_what_does_not_fit_is_cut():
    text = text_of(cell("12 /s ", Level.PLAIN) + cell("lost", Level.BAD))
    assert text.plain == "12 /s lost"
    assert [(span.start, span.end, span.style) for span in text.spans] == [(6, 10, "red")]
    assert (text.overflow, text.no_wrap) == ("ellipsis", True)


def test_each_greeting_is_printed_once_in_whatever_order_attendants_come_and_go(full, capsys):
    view = TerminalView(full, Console(file=io.StringIO()))
    for greetings in (
        ["foxglove"],
        ["console", "foxglove"],
        ["console"],
        ["console", "foxglove"],
        ["foxglove"],
    ):
        full.launcher.greetings = greetings
        view.print_tidings()
    lines = [line for line in capsys.readouterr().out.splitlines() if " s  " not in line]
    assert lines == ["foxglove", "console"]


def test_lines_of_a_log_name_the_vehicles_that_are_known(full, capsys):
    view = TerminalView(full, Console(file=io.StringIO()))
    view.print_tidings()
    view.print_tidings()
    full.monitor.vehicles["beta"].is_known = True
    view.print_vehicles()
    lines = capsys.readouterr().out.splitlines()
    assert lines.count("console: http://127.0.0.1:8400/") == 1  # as it is, for programs that look for it
    lines = [line for line in lines if not line.startswith("console: ")]
    assert [line.partition(" s  ")[2] for line in lines] == [
        "alpha: flying",
        "starting: waiting for alpha_sky",
        "beta  imu   0/s lost 0",
    ]
