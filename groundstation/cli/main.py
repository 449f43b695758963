"""The ``groundstation`` command: one row per sub-command, imported only when it is called."""

from __future__ import annotations

import importlib
import os
import sys
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import typer


class Command(NamedTuple):
    """Where a sub-command lives, and the line that the overview shows."""

    target: str
    summary: str


COMMANDS = {
    "run": Command("groundstation.cli.run:app", "Fly the vehicles of a rig."),
    "replay": Command(
        "groundstation.cli.replay:app", "Feed a recording through the nodes again and compare."
    ),
    "recording": Command("groundstation.cli.recording:app", "Look into recordings, recover a torn one."),
    "report": Command("groundstation.cli.report:app", "Draw the figures of a recording."),
    "request": Command(
        "groundstation.cli.request:app", "Ask something of a running vehicle: arm, stop, go_to."
    ),
    "devices": Command("groundstation.cli.devices:app", "Ask every serial port who is there."),
    "star-tracker": Command("groundstation.cli.star_tracker:app", "Star fixes from frames; surveys."),
    "fusion": Command("groundstation.cli.fusion:app", "State estimates from IMU and star fixes in files."),
    "calibrate": Command("groundstation.cli.calibrate:app", "From recordings to calibration numbers."),
}


def build(called: str | None) -> typer.Typer:
    """The command line: the sub-command that is called is imported, of the others only the summary shows.

    Args:
        called: Name of the sub-command, None or unknown for the overview.
    """
    import typer  # here, so that Ctrl-C is understood before anything heavy is loaded

    app = typer.Typer(no_args_is_help=True, add_completion=False, rich_markup_mode=None)

    @app.callback()
    def root() -> None:
        """Ground station for planar satellite testbeds.

        Example: groundstation run examples/rigs/two_mock_ups.toml
        """

    for name, row in COMMANDS.items():
        if name != called:
            app.command(name, help=row.summary)(_not_called)
            continue
        module, _, attribute = row.target.partition(":")
        found: typer.Typer = getattr(importlib.import_module(module), attribute)
        if (
            len(found.registered_commands) == 1
            and not found.registered_groups
            and not found.registered_callback
        ):
            only = found.registered_commands[0]
            only.name = name
            app.registered_commands.append(only)
        else:
            app.add_typer(found, name=name, help=row.summary)
    return app


def _not_called() -> None:
    """Stand in for a command in the overview."""


def call(words: list[str]) -> int:
    """Run the command line; every error of ours is one sentence. Returns the exit code."""
    from calibration.camera.errors import CalibrationFileError
    from drivers.errors import DeviceError
    from groundstation.core.library import CoreError
    from groundstation.recording.errors import RecordingError
    from groundstation.runtime.errors import GroundStationError, UsageError

    try:
        build(words[0] if words else None)(words, prog_name="groundstation")
    except SystemExit as done:
        return done.code if isinstance(done.code, int) else int(done.code is not None)
    except (UsageError, DeviceError, RecordingError, CalibrationFileError) as error:
        sys.stderr.write(f"groundstation: {error}\n")
        return 2
    except (GroundStationError, CoreError) as error:
        sys.stderr.write(f"groundstation: {error}\n")
        return 1
    return 0


def main() -> None:
    """Entry point."""
    words = sys.argv[1:]
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
