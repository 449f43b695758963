"""The ``groundstation`` command: one row per sub-command, imported only when it is called."""

import importlib
import sys
from typing import Any, NamedTuple

import click
import typer
from typer.core import TyperGroup
from typer.main import get_command

from drivers.errors import DeviceError
from groundstation.runtime.errors import GroundStationError, UsageError


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


class _LazyGroup(TyperGroup):
    def list_commands(self, ctx: click.Context) -> list[str]:
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        del ctx
        row = COMMANDS.get(cmd_name)
        if row is None:
            return None
        module, _, attribute = row.target.partition(":")
        found: Any = getattr(importlib.import_module(module), attribute)
        command = get_command(found)
        command.name = cmd_name
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl([(name, row.summary) for name, row in COMMANDS.items()])


app = typer.Typer(cls=_LazyGroup, no_args_is_help=True, add_completion=False, rich_markup_mode=None)


@app.callback()
def _root() -> None:
    """Ground station for planar satellite testbeds.

    Example: groundstation run examples/rigs/two_mock_ups.toml
    """


def main() -> None:
    """Entry point: every error of ours is one sentence and exit code 2."""
    try:
        app()
    except (UsageError, DeviceError) as error:
        sys.stderr.write(f"groundstation: {error}\n")
        raise SystemExit(2) from None
    except GroundStationError as error:
        sys.stderr.write(f"groundstation: {error}\n")
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
