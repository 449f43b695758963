"""``groundstation inject``: let the emulated laboratory of a running rig inject a failure."""

import json
from typing import Annotated

import typer

from groundstation.declarations.errors import UsageError
from groundstation.declarations.request import ArgumentError, checked_name
from groundstation.launch.asking import ask, user_name
from groundstation.launch.running import choose_run
from groundstation.parts.table import installed_tables

app = typer.Typer(rich_markup_mode=None)


@app.command(context_settings={"ignore_unknown_options": True, "allow_extra_args": True})
def inject(
    context: typer.Context,
    vehicle: Annotated[str, typer.Argument(help="Name of the vehicle, as in the rig file.")],
    failure: Annotated[str, typer.Argument(help="Row of the laboratory's table of failures.")],
    for_s: Annotated[float, typer.Option("--for", help="How long, seconds.", min=0.001)] = 10.0,
    timeout: Annotated[float, typer.Option(help="Seconds to wait for the answer.", min=0.1, max=3600)] = 3.0,
    pid: Annotated[int | None, typer.Option(help="Process of the run, where several are going on.")] = None,
    name: Annotated[
        str | None, typer.Option("--as", help="In whose name; your user name if it is left out.")
    ] = None,
) -> None:
    """Inject a failure into the emulated laboratory of a running rig, e.g. --valve 3.

    Exit code 0 if it was accepted, 1 if it was refused or nobody answered.

    Example: groundstation inject alpha stuck_open_valve --valve 3 --for 5
    """
    action = installed_tables().actions["inject"]
    parameters = json.dumps(_parameters(list(context.args)))
    try:
        given = action.check({"failure": failure, "for_s": for_s, "parameters": parameters})
        author = checked_name(name or user_name())
    except ArgumentError as error:
        raise UsageError(str(error)) from error
    run = choose_run(vehicle, pid)
    ack = ask(run.endpoint, vehicle, action.name, given, author, timeout)
    verdict = "accepted" if ack.accepted else f"refused: {ack.reason}"
    print(f"{vehicle} ({run.rig}): inject {failure} for {for_s:g} s: {verdict}")
    if not ack.accepted:
        raise typer.Exit(1)


def _parameters(words: list[str]) -> dict[str, float]:
    """Pairs of ``--name value``."""
    found = {}
    while words:
        name = words.pop(0)
        if not name.startswith("--") or not words:
            raise UsageError(f"expected --parameter value, found {name!r}")
        word, parameter = words.pop(0), name.removeprefix("--").replace("-", "_")
        if parameter in found:
            raise UsageError(f"{name} is given twice")
        try:
            found[parameter] = float(word)
        except ValueError:
            raise UsageError(f"{name} is {word!r}, expected a number") from None
    return found
