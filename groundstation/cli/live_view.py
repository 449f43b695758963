"""A live run on a terminal: a view or lines, until it is over or somebody asks for the end."""

import signal
import time
from collections.abc import Callable
from types import FrameType

from rich.console import Console

from groundstation.cli.keys import HELP, Keys, stdin_descriptor
from groundstation.cli.terminal_view import TerminalView
from groundstation.launch.asking import user_name
from groundstation.launch.live_run import LiveRun

REFRESH_S = 0.25
LINE_EVERY_S = 2.0
WAKING_S = 2.0
"""A run that has stood still goes on for so long at least: its processes find each other again."""


def never() -> bool:
    """It has no end of its own."""
    return False


class _Ending:
    """Ctrl-C and SIGTERM ask for the end; asked again, they change nothing."""

    def __init__(self) -> None:
        self.asked = False
        for kind in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(kind, self.ask)

    def ask(self, number: int = 0, frame: FrameType | None = None) -> None:
        """Ask for the end."""
        del number, frame
        self.asked = True


def run_live(
    live: LiveRun, duration: float | None, *, headless: bool, is_over: Callable[[], bool] = never
) -> None:
    """Run until somebody asks for the end, for a time after all is ready, or until it is over.

    Time in which the process stood still (Ctrl-Z and fg) does not count.
    """
    ending = _Ending()
    console = Console()
    view = TerminalView(live, console)
    try:
        live.start(lambda: ending.asked)
        until_s = None
        next_line_s = 0.0
        keys = Keys(
            stdin_descriptor(),
            live.launcher.endpoint,
            tuple(live.rig.vehicles),
            user_name(),
            live.monitor.note,
            ending.ask,
        )
        if ending.asked:
            return
        with keys, view.opened(headless=headless, keys=HELP if keys.are_read else ""):
            while not ending.asked:
                stood_s = live.step(REFRESH_S)
                now_s = time.monotonic()
                if until_s is not None and stood_s:
                    until_s = max(until_s + stood_s, now_s + WAKING_S)
                if until_s is None and (duration is not None or is_over is not never):
                    live.check_start()
                    if live.is_ready and duration is not None:
                        until_s = now_s + duration
                if is_over() or (until_s is not None and now_s >= until_s):
                    break
                if not headless:
                    view.refresh()
                    continue
                view.print_tidings()
                if now_s >= next_line_s:
                    view.print_vehicles()
                    next_line_s = now_s + LINE_EVERY_S
    finally:
        live.close()
