"""``groundstation request``: ask something of a running vehicle."""

import getpass
import math
import sys
from collections.abc import Mapping
from functools import cache
from typing import Annotated

import typer

from groundstation.declarations.errors import UsageError
from groundstation.declarations.request import Action, Argument, ArgumentError
from groundstation.launch.asking import ask
from groundstation.launch.running import choose_run
from groundstation.parts.table import installed_tables, own_tables

# "-0.2" is a number and no option
_NUMBERS = {"ignore_unknown_options": True}

app = typer.Typer(rich_markup_mode=None)


def _shown(argument: Argument) -> str:
    return argument.name.replace("_rad", "_deg")


@cache
def _actions() -> Mapping[str, Action]:
    """All actions; a broken package costs its own ones only, since a stop must pass."""
    try:
        return installed_tables().actions
    except UsageError as error:
        sys.stderr.write(f"{error}; its actions are left out\n")
        return own_tables().actions


def _described() -> str:
    rows = _actions().values()
    return "\n\n".join(" ".join([row.name, *map(_shown, row.arguments)]) + f": {row.summary}" for row in rows)


@app.command(
    context_settings=_NUMBERS,
    epilog=f"Actions and their arguments:\n\n{_described()}",
)
def request(
    vehicle: Annotated[str, typer.Argument(help="Name of the vehicle, as in the rig file.")],
    action: Annotated[str, typer.Argument(help="What it is to do.")],
    arguments: Annotated[
        list[str] | None, typer.Argument(help="In their order, or as name=value; metres, and degrees.")
    ] = None,
    timeout: Annotated[float, typer.Option(help="Seconds to wait for the answer.", min=0.1, max=3600)] = 3.0,
    pid: Annotated[int | None, typer.Option(help="Process of the run, where several are going on.")] = None,
) -> None:
    """Ask something of a running vehicle and print the answer.

    Exit code 0 if it was accepted, 1 if it was refused or nobody answered.

    Example: groundstation request alpha go_to 0.2 0.1 90
    """
    actions = _actions()
    row = actions.get(action)
    if row is None:
        raise UsageError(f"there is no action {action!r} (there are {', '.join(actions)})")
    words = arguments or []
    try:
        given = row.check(_values(row, words))
    except ArgumentError as error:
        raise UsageError(str(error)) from error
    run = choose_run(vehicle, pid)
    ack = ask(run.endpoint, vehicle, action, given, getpass.getuser(), timeout)
    asked = " ".join([action, *words])
    verdict = "accepted" if ack.accepted else f"refused: {ack.reason}"
    print(f"{vehicle} ({run.rig}): {asked}: {verdict}")
    if not ack.accepted:
        raise typer.Exit(1)


def _values(row: Action, words: list[str]) -> dict[str, object]:
    """Arguments by name, SI, from words in order or as ``name=value``."""
    names = {_shown(argument): argument for argument in row.arguments}
    if not any("=" in word for word in words):
        least = sum(argument.default is None for argument in row.arguments)
        if not least <= len(words) <= len(names):
            wanted = " ".join(names) or "no arguments"
            raise ArgumentError(f"{row.name} takes {wanted}, found {len(words)} words")
        pairs = list(zip(names, words, strict=False))
    else:
        pairs = [(name, value) for name, _, value in (word.partition("=") for word in words)]
    values: dict[str, object] = {}
    for name, word in pairs:
        argument = names.get(name)
        if argument is None:
            raise ArgumentError(f"{row.name} has no argument {name!r}: it takes {' '.join(names) or 'none'}")
        values[argument.name] = _value(argument, name, word)
    return values


def _value(argument: Argument, name: str, word: str) -> object:
    if argument.kind is str:
        return word
    try:
        number = float(word) if argument.kind is float else int(word)
    except ValueError:
        raise ArgumentError(f"{name} is {word!r}, expected a number") from None
    return math.radians(number) if name.endswith("_deg") else number
