"""``groundstation request``: ask something of a running vehicle, or of all."""

import math
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Annotated, Any, NamedTuple

import typer
from typer.core import TyperCommand

from groundstation.declarations.errors import GroundStationError, UsageError
from groundstation.declarations.lease import FREE_FOR_ALL
from groundstation.declarations.request import (
    Ack,
    Action,
    Argument,
    ArgumentError,
    Value,
    checked_name,
    shown_name,
)
from groundstation.launch.asking import ask_each, silence, user_name
from groundstation.launch.running import RunningRig, choose_run, choose_runs
from groundstation.launch.stop_button import EVERY, press_stop
from groundstation.parts.supervision.actions import ACTIONS

# "-0.2" is a number and no option
_NUMBERS = {"ignore_unknown_options": True}

ALL, STOP = "all", "stop"
FOR_ALL = ("stop", "land", "release", "fly", "disarm", "float_off")
"""Actions that all vehicles can be asked for at once."""

app = typer.Typer(rich_markup_mode=None)


def _shown(argument: Argument) -> str:
    return argument.name.replace("_rad", "_deg")


@cache
def _actions() -> Mapping[str, Action]:
    """All actions; a broken package costs its own ones only."""
    from groundstation.parts.table import installed_tables, own_tables  # half a second that a stop has not

    try:
        return installed_tables().actions
    except UsageError as error:
        sys.stderr.write(f"{error}; its actions are left out\n")
        return own_tables().actions


def _described() -> str:
    rows = _actions().values()
    return "\n\n".join(" ".join([row.name, *map(_shown, row.arguments)]) + f": {row.summary}" for row in rows)


class _WithActions(TyperCommand):
    """Its help ends with the table of actions, which is read only then."""

    def format_epilog(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 types that typer keeps to itself
        self.epilog = f"Actions and their arguments:\n\n{_described()}"
        super().format_epilog(ctx, formatter)


@app.command(context_settings=_NUMBERS, cls=_WithActions)
def request(
    vehicle: Annotated[str, typer.Argument(help="Name of the vehicle, as in the rig file; or all.")],
    action: Annotated[str, typer.Argument(help="What it is to do.")],
    arguments: Annotated[
        list[str] | None, typer.Argument(help="In their order, or as name=value; metres, and degrees.")
    ] = None,
    timeout: Annotated[float, typer.Option(help="Seconds to wait for the answer.", min=0.1, max=3600)] = 3.0,
    pid: Annotated[int | None, typer.Option(help="Process of the run, where several are going on.")] = None,
    name: Annotated[
        str | None, typer.Option("--as", help="In whose name; your user name if it is left out.")
    ] = None,
) -> None:
    """Ask something of a running vehicle, or of all, and print the answer.

    A stop has a path of its own, and is repeated until every vehicle has taken it. All vehicles can be
    asked to stop, land, release, fly, disarm or float_off. take_control, give_control and start_scenario
    concern the rig: name any vehicle, or all.

    Exit code 0 if it was accepted, 1 if it was refused or nobody answered.

    Example: groundstation request alpha go_to 0.2 0.1 90

    Example: groundstation request all stop
    """
    actions = ACTIONS if action == STOP else _actions()  # a stop waits for no package, broken or not
    row = actions.get(action)
    if row is None:
        raise UsageError(f"there is no action {action!r} (there are {', '.join(actions)})")
    words = arguments or []
    try:
        given = row.check(_values(row, words))
    except ArgumentError as error:
        raise UsageError(str(error)) from error
    if vehicle == ALL and action not in FOR_ALL and not row.is_of_rig:
        raise UsageError(f"{action} is asked of one vehicle; all can be asked to {', '.join(FOR_ALL)}")
    author = _author(name or user_name(), action)
    runs = choose_runs(pid) if vehicle == ALL else [choose_run(vehicle, pid)]

    def work(run: RunningRig) -> list[_Answer]:
        try:
            if action == STOP:
                return _stop(run, EVERY if vehicle == ALL else vehicle, author, timeout)
            return _ask(run, vehicle, row, given, author, timeout)
        except GroundStationError as error:
            if len(runs) == 1:
                raise
            return [_Answer(name, str(error), False) for name in run.vehicles]

    with ThreadPoolExecutor(len(runs)) as pool:  # no rig waits for another one
        found = list(pool.map(work, runs))
    answers = [(run, answer) for run, of_run in zip(runs, found, strict=True) for answer in of_run]
    asked = " ".join([action, *words])
    for run, answer in answers:
        print(f"{answer.vehicle} ({run.rig}): {asked}: {answer.words}")
    if not all(answer.is_well for _, answer in answers):
        raise typer.Exit(1)


class _Answer(NamedTuple):
    """What became of a request of one vehicle."""

    vehicle: str
    words: str
    is_well: bool


def _author(name: str, action: str) -> str:
    """Who asks; what takes motion away is not refused for a name."""
    if action in FREE_FOR_ALL:
        return shown_name(name)
    try:
        return checked_name(name)
    except ArgumentError as error:
        raise UsageError(str(error)) from error


def _ask(
    run: RunningRig, vehicle: str, action: Action, given: Mapping[str, Value], author: str, timeout_s: float
) -> list[_Answer]:
    vehicles = run.vehicles if vehicle == ALL else (vehicle,)
    if action.is_of_rig:
        vehicles = ("",)
    acks = ask_each(run.endpoint, vehicles, action.name, given, author, timeout_s)
    if len(vehicles) == 1 and not acks:
        raise GroundStationError(silence(vehicles[0], timeout_s))
    return [_answer(name, acks.get(name), timeout_s) for name in vehicles]


def _answer(vehicle: str, ack: Ack | None, timeout_s: float) -> _Answer:
    if ack is None:
        return _Answer(vehicle or ALL, f"no answer within {timeout_s:g} s", False)
    return _Answer(vehicle or ALL, "accepted" if ack.accepted else f"refused: {ack.reason}", ack.accepted)


def _stop(run: RunningRig, vehicle: str, author: str, timeout_s: float) -> list[_Answer]:
    press = press_stop(run.endpoint, run.vehicles, vehicle, author, timeout_s)
    answers = []
    for name in run.vehicles:
        ruling = press.stopped.get(name)
        if ruling is not None:
            answers.append(_Answer(name, f"accepted, it is {ruling.mode}", True))
        elif name in press.waiting:
            answers.append(
                _Answer(name, f"NOT CONFIRMED within {timeout_s:g} s: go and cut its air by hand", False)
            )
    return answers


def _values(row: Action, words: list[str]) -> dict[str, object]:
    """Arguments by name, SI, from words in order or as ``name=value``."""
    names = {_shown(argument): argument for argument in row.arguments}
    if not any("=" in word for word in words):
        least = sum(argument.default is None for argument in row.arguments)
        if not least <= len(words) <= len(names):
            shown = (name if names[name].default is None else f"[{name}]" for name in names)
            wanted = " ".join(shown) or "no arguments"
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
