"""The ``groundstation`` command: one row per sub-command, imported only when it is called."""

from __future__ import annotations

import errno
import importlib
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from groundstation.cli.command import Command, Group
from groundstation.cli.completion import typed
from groundstation.cli.extensions import BrokenCommandError, Row, extension, extensions
from groundstation.cli.plain_words import speak_any_locale

if TYPE_CHECKING:
    import typer

COMMANDS: dict[str, Row] = {
    "run": Command("groundstation.cli.run:app", "Fly the vehicles of a rig, or a scenario."),
    "campaign": Command("groundstation.cli.campaign:app", "Fly a scenario many times."),
    "replay": Command(
        "groundstation.cli.replay:app", "Feed a recording through the nodes again and compare."
    ),
    "console": Command("groundstation.cli.console:app", "Look at a recording in the web console."),
    "recording": Command("groundstation.cli.recording:app", "Look into recordings, recover a torn one."),
    "report": Command("groundstation.cli.report:app", "Draw the figures of a recording."),
    "status": Command("groundstation.cli.status:app", "Show every running rig on one screen."),
    "watch": Command("groundstation.cli.watch:app", "Show what a running rig publishes on a topic."),
    "request": Command(
        "groundstation.cli.request:app", "Ask something of a running vehicle, or stop all: arm, stop, go_to."
    ),
    "inject": Command("groundstation.cli.inject:app", "Inject a failure into the emulated laboratory."),
    "parts": Command("groundstation.cli.parts:app", "Show the whole system: topics, nodes, processes."),
    "faults": Command("groundstation.cli.faults:app", "Show modes, what moves them, and every fault."),
    "demo": Command("groundstation.cli.demo:app", "Make small data sets of every kind to try commands on."),
    "doctor": Command("groundstation.cli.doctor:app", "Check this machine before a flight day."),
    "certificates": Command(
        "groundstation.cli.certificates:app", "Make certificates for the console and for other hosts."
    ),
    "devices": Command("groundstation.cli.devices:app", "Ask every serial port who is there."),
    "star-tracker": Command("groundstation.cli.star_tracker:app", "Star fixes from frames in a folder."),
    "reproduce": Command("groundstation.cli.reproduce:app", "Run published experiments again."),
    "fusion": Command("groundstation.cli.fusion:app", "State estimates from IMU and star fixes in files."),
    "relative": Command(
        "groundstation.cli.relative:app", "Where another craft is and how it turns, by camera."
    ),
}
ALIASES = {
    ("star-tracker", "survey"): ("calibrate", "survey"),
    ("star-tracker", "intrinsics"): ("calibrate", "lens"),
    ("star-tracker", "board"): ("calibrate", "board"),
    ("star-tracker", "mount"): ("calibrate", "mount"),
    ("star-tracker", "delay"): ("calibrate", "delay"),
    ("star-tracker", "amend"): ("calibrate", "amend"),
    ("star-tracker", "overhead-pose"): ("calibrate", "overhead"),
}
"""Spellings of before that go on working."""
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
DEBUG = "GROUNDSTATION_DEBUG"
"""Set in the environment, or by ``--debug`` on the line: an error's traceback comes before its sentence."""


def spelled(words: list[str]) -> list[str]:
    """Return what is called in its spelling of today."""
    return [*ALIASES.get((words[0], words[1]), words[:2]), *words[2:]] if len(words) > 1 else words


def build(words: list[str]) -> typer.Typer:
    """The command line: the command that is called is imported, of the others only the summary shows.

    Args:
        words: What is called; the name of a command first, anything else gives the overview.

    Raises:
        BrokenCommandError: The command is of an installed package and cannot be loaded.
    """
    import typer  # here, so that Ctrl-C is understood before anything heavy is loaded

    app = typer.Typer(no_args_is_help=True, rich_markup_mode=None)

    @app.callback()
    def root() -> None:
        """Ground station for planar satellite testbeds.

        Example: groundstation run examples/rigs/two_mock_ups.toml
        """

    called = words[0] if words else ""
    if called in COMMANDS:
        rows = {called: COMMANDS[called]}
    else:
        found = extension(called)
        rows = extensions() | COMMANDS if found is None else {called: found}
    for name, row in rows.items():
        if name == called:
            _add(app, name, row, words[1:])
        else:
            app.command(name, help=row.summary)(_not_called)
    return app


def _add(app: typer.Typer, name: str, row: Row, words: list[str]) -> None:
    """Put a command that is called on the command line; of a group only the member that is called."""
    import typer

    if isinstance(row, Group):
        group = typer.Typer(
            no_args_is_help=True,
            add_completion=False,
            rich_markup_mode=None,
            help=f"{row.summary}\n\nExample: {row.example}",
            callback=_root,
        )
        for member, command in row.members.items():
            if words and member == words[0]:
                _add(group, member, command, words[1:])
            else:
                group.command(member, help=command.summary)(_not_called)
        app.add_typer(group, name=name)
        return
    found = _load(row)
    if not isinstance(found, typer.Typer):
        app.command(name)(found)
    elif (
        len(found.registered_commands) == 1 and not found.registered_groups and not found.registered_callback
    ):
        only = found.registered_commands[0]
        only.name = name
        app.registered_commands.append(only)
    else:
        app.add_typer(found, name=name)


def _load(row: Command) -> typer.Typer | Callable[..., Any]:
    module, _, attribute = row.target.partition(":")
    try:
        found: typer.Typer | Callable[..., Any] = getattr(importlib.import_module(module), attribute)
    except (Exception, SystemExit) as error:  # whatever somebody's package raises while it is imported
        if module.startswith("groundstation."):
            raise
        raise BrokenCommandError(f"{row.target} cannot be loaded ({error}).") from error
    return found


def _root() -> None:
    """Make a group of a typer with a single command."""


def _not_called() -> None:
    """Stand in for a command in the overview."""


def call(words: list[str]) -> int:
    """Run the command line; every error of ours is one sentence. Returns the exit code."""
    from drivers.errors import DeviceError
    from groundstation.cli.strict_numbers import check_numbers
    from groundstation.core.library import CoreError
    from groundstation.declarations.errors import GroundStationError, UsageError
    from groundstation.files.errors import FileError
    from groundstation.recording.errors import RecordingError

    if "--debug" in words:
        words = [word for word in words if word != "--debug"]
        os.environ[DEBUG] = "1"  # for the processes of a run, too
    words = spelled(words)
    try:
        app = build(spelled(typed(os.environ) or words))
        check_numbers(app)
        app(words, prog_name="groundstation")
    except SystemExit as done:
        return done.code if isinstance(done.code, int) else int(done.code is not None)
    except (UsageError, DeviceError, RecordingError, FileError, BrokenCommandError) as error:
        return _refuse(error, 2)
    except (GroundStationError, CoreError) as error:
        return _refuse(error, 1)
    except BrokenPipeError:  # nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 1
    except OSError as error:
        if error.filename is None and error.errno not in _FULL:
            raise
        where = "" if error.filename is None else f"{error.filename}: "
        return _refuse(OSError(f"{where}{error.strerror}."), 2)
    return 0


def _refuse(error: Exception, code: int) -> int:
    """Write the sentence of an error of ours, after its traceback where that is asked for."""
    if os.environ.get(DEBUG):
        import traceback

        traceback.print_exception(error)
    sys.stderr.write(f"groundstation: {error}\n")
    return code


def main() -> None:
    """Entry point."""
    words = sys.argv[1:]
    speak_any_locale()
    if words[:1] == ["run"]:  # before NumPy loads: a run forks its processes, and threads are not forked
        os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
    try:
        code = call(words)
    except KeyboardInterrupt:  # before a command took the signal over: nothing had been started yet
        code = 0 if words[:1] == ["run"] else 130
    if "zenoh" in sys.modules:  # all sessions are closed; its threads would take seconds to wind down
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    raise SystemExit(code)


if __name__ == "__main__":
    main()
