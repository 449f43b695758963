"""``groundstation run``: fly the vehicles of a rig, live or in lockstep."""

import getpass
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from groundstation.cli.keys import HELP, Keys, stdin_descriptor
from groundstation.cli.terminal_view import TerminalView
from groundstation.core.library import default_core
from groundstation.declarations.errors import GroundStationError, UsageError
from groundstation.files.writing import check_folder
from groundstation.launch.live_run import LiveRun
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.writer import PART_SUFFIX, check_new_recording
from groundstation.rig.read import parse_rig, read_text

app = typer.Typer(rich_markup_mode=None)

LONGEST_S = 31_557_600.0  # a year: a typo beyond it
REFRESH_S = 0.25
LINE_EVERY_S = 2.0
LANDED_BY_FAULT = 1
"""Exit code of a run in which a vehicle ended otherwise than it should."""


@app.command()
def run(
    rig: Annotated[Path, typer.Argument(help="Rig file (TOML).")],
    duration: Annotated[
        float | None,
        typer.Option(help="End by itself after this many seconds.", min=0.1, max=LONGEST_S),
    ] = None,
    headless: Annotated[bool, typer.Option("--headless", help="Write lines instead of a view.")] = False,
    report: Annotated[Path | None, typer.Option(help="Leave report.html and report.json here.")] = None,
    compare: Annotated[
        Path | None, typer.Option(help="Recording that --report draws beneath this run.")
    ] = None,
    record: Annotated[Path | None, typer.Option(help="Recording to write (.mcap).")] = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Virtual time, as fast as the CPU allows; needs --duration.")
    ] = False,
    seed: Annotated[int | None, typer.Option(help="Of the emulated laboratory, in lockstep.")] = None,
) -> None:
    """Fly the vehicles of a rig until Ctrl-C, or for --duration seconds.

    On a terminal the space bar stops all vehicles, l lands them, q ends the run.

    Exit code 0; 1 where a fault landed a vehicle, or the recording could not be written to the end; 2 where
    the rig is wrong. What a person stops or lands is no fault.

    Example: groundstation run examples/rigs/two_mock_ups.toml

    Example: groundstation run examples/rigs/published.toml --lockstep --duration 120 --report report
    """
    default_core()  # before any process starts: what it lacks, all of them would
    text = read_text(rig)
    loaded = parse_rig(text, rig)
    if record is not None:
        check_new_recording(record)
    if report is not None:
        check_folder(report)
    if compare is not None:
        if report is None:
            raise UsageError("--compare goes with --report: the recording is drawn in its page")
        check_recording(compare)
    stamp = time.strftime("%Y-%m-%d_%H-%M-%S")
    recording = record or loaded.record.directory / f"{stamp}.mcap"
    if lockstep:
        if duration is None:
            raise UsageError("--lockstep needs --duration: virtual time has no end of its own")
    elif seed is not None:
        raise UsageError("--seed goes with --lockstep; live, the rig's [laboratory] table holds the seed")
    trouble = ""
    try:
        if lockstep:
            assert duration is not None
            with _progress(duration) as update:
                faults = run_lockstep(loaded, text, rig, recording, duration, seed, update)
        else:
            live = LiveRun(loaded, text, rig, recording)
            _run_live(live, duration, headless=headless or not sys.stdout.isatty())
            faults, trouble = live.faults, live.launcher.recording_trouble
    finally:
        finished, torn = _say_recordings(recording)
    for line in faults.lines():
        print(line)
    if trouble or (torn and not finished):
        raise GroundStationError(trouble or f"no recording was finished: {torn[0]} is what is left")
    if report is not None:
        if not finished:
            raise GroundStationError("there is no report: no recording was finished")
        from groundstation.cli.report import print_report  # only now: a start need not wait for it

        print_report(finished[-1], report, compare=compare)
    if faults.brought_down:
        raise typer.Exit(LANDED_BY_FAULT)


def check_recording(path: Path) -> None:
    """Refuse a recording that cannot be read, before anything moves.

    Raises:
        UsageError: It says why.
    """
    try:
        Recording(path).close()
    except RecordingError as error:
        raise UsageError(str(error)) from error


def _say_recordings(recording: Path) -> tuple[list[Path], list[Path]]:
    """Name the files of a run; a recorder that was started again left several. Finished ones, and others."""
    every = [recording, *sorted(recording.parent.glob(f"{recording.stem}_[0-9]*{recording.suffix}*"))]
    torn = recording.with_name(recording.name + PART_SUFFIX)
    finished = [path for path in every if path.suffix == recording.suffix and path.exists()]
    for path in finished:
        print(f"recording: {path}")
    left = [path for path in [torn, *every] if path.name.endswith(PART_SUFFIX) and path.exists()]
    for path in left:
        print(f"not finished: {path} (groundstation recording recover brings back what it holds)")
    return finished, left


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


def _run_live(live: LiveRun, duration: float | None, *, headless: bool) -> None:
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
            getpass.getuser(),
            live.monitor.note,
            ending.ask,
        )
        if ending.asked:
            return
        with keys, view.opened(headless=headless, keys=HELP if keys.are_read else ""):
            while not ending.asked:
                live.step(REFRESH_S)
                now_s = time.monotonic()
                if until_s is None and duration is not None:
                    live.check_start()
                    if live.is_ready:
                        until_s = now_s + duration
                if until_s is not None and now_s >= until_s:
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


class _progress:  # noqa: N801 used like a function
    """A bar on a terminal for what takes seconds; silent elsewhere."""

    def __init__(self, total: float) -> None:
        self._bar = Progress(
            TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), console=Console(stderr=True)
        )
        self._bar.disable = not sys.stderr.isatty()
        self._task = self._bar.add_task("", total=total)

    def __enter__(self) -> Callable[[str, float], None]:
        self._bar.start()
        return lambda text, done: self._bar.update(self._task, description=text, completed=done)

    def __exit__(self, *_: object) -> None:
        self._bar.stop()
