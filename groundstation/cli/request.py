"""``groundstation request``: ask something of a running vehicle."""

import getpass
import math
from typing import Annotated

import typer

from groundstation.cli.errors import UsageError
from groundstation.declarations.request import ACTIONS
from groundstation.launch.asking import ask
from groundstation.launch.running import RunningRig, find_running

_ACTIONS = "\n\n".join(
    " ".join([name, *(argument.replace("_rad", "_deg") for argument in row.arguments)]) + f": {row.summary}"
    for name, row in ACTIONS.items()
)

# "-0.2" is a number and no option
_NUMBERS = {"ignore_unknown_options": True}

app = typer.Typer(rich_markup_mode=None)


@app.command(
    context_settings=_NUMBERS,
    epilog=f"Actions and their numbers:\n\n{_ACTIONS}",
)
def request(
    vehicle: Annotated[str, typer.Argument(help="Name of the vehicle, as in the rig file.")],
    action: Annotated[str, typer.Argument(help="What it is to do.")],
    numbers: Annotated[list[float] | None, typer.Argument(help="Metres, and degrees.")] = None,
    timeout: Annotated[float, typer.Option(help="Seconds to wait for the answer.", min=0.1)] = 3.0,
    pid: Annotated[int | None, typer.Option(help="Process of the run, where several are going on.")] = None,
) -> None:
    """Ask something of a running vehicle and print the answer.

    Exit code 0 if it was accepted, 1 if it was refused or nobody answered.

    Example: groundstation request alpha go_to 0.2 0.1 90
    """
    row = ACTIONS.get(action)
    if row is None:
        raise UsageError(f"there is no action {action!r} (there are {', '.join(ACTIONS)})")
    said = tuple(numbers or ())
    if len(said) != len(row.arguments):
        wanted = " ".join(name.replace("_rad", "_deg") for name in row.arguments) or "no numbers"
        raise UsageError(f"{action} takes {wanted}, found {len(said)} numbers")
    if not all(math.isfinite(number) for number in said):
        raise UsageError(f"{action} takes finite numbers, found {' '.join(map(str, said))}")
    arguments = tuple(
        math.radians(number) if name.endswith("_rad") else number
        for name, number in zip(row.arguments, said, strict=True)
    )
    run = _choose(find_running(), vehicle, pid)
    ack = ask(run.endpoint, vehicle, action, arguments, getpass.getuser(), timeout)
    words = " ".join([action, *(f"{number:g}" for number in said)])
    verdict = "accepted" if ack.accepted else f"refused: {ack.reason}"
    print(f"{vehicle} ({run.rig}): {words}: {verdict}")
    if not ack.accepted:
        raise typer.Exit(1)


def _choose(runs: list[RunningRig], vehicle: str, pid: int | None) -> RunningRig:
    """The run that is meant."""
    if pid is not None:
        runs = [run for run in runs if run.pid == pid]
    if not runs:
        whose = "" if pid is None else f" with process {pid}"
        raise UsageError(f"no rig is running{whose}: start one with `groundstation run`")
    fitting = [run for run in runs if vehicle in run.vehicles]
    if not fitting:
        known = ", ".join(name for run in runs for name in run.vehicles)
        raise UsageError(f"no vehicle {vehicle!r} is running (running: {known})")
    if len(fitting) > 1:
        known = ", ".join(f"{run.pid} ({run.rig})" for run in fitting)
        raise UsageError(f"several rigs fly a {vehicle!r}: choose one with --pid: {known}")
    return fitting[0]
