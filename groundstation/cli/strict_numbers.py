"""Numbers on the command line are such as somebody can mean, wherever a command takes one.

Infinity and NaN are refused; what states no largest amount of its own is judged by the unit that its name
ends in, as the numbers in files are.
"""

import inspect
import math
from collections.abc import Callable, Iterable
from functools import wraps
from typing import Any

import typer

from groundstation.declarations.errors import UsageError
from groundstation.files.amounts import fault_of


def check_numbers(app: typer.Typer) -> None:
    """Let every command of an app, and of the groups in it, refuse what is no number that can be meant."""
    for command in app.registered_commands:
        if command.callback is not None:
            command.callback = _strict(command.callback)
    for group in app.registered_groups:
        if group.typer_instance is not None:
            check_numbers(group.typer_instance)


def _strict(callback: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(callback)
    def checked(**given: object) -> object:
        for name, value in given.items():
            for number in _numbers(value):
                fault = _fault(callback, name, number)
                if fault:
                    raise UsageError(f"{_spelled(callback, name)} {fault}")
        return callback(**given)

    return checked


def _numbers(value: object) -> Iterable[int | float]:
    """Those of an option, or of one that may be repeated."""
    found = value if isinstance(value, list | tuple) else (value,)
    return (each for each in found if isinstance(each, int | float) and not isinstance(each, bool))


def _fault(callback: Callable[..., Any], name: str, number: float) -> str:
    if isinstance(number, float) and not math.isfinite(number):
        return f"is {number}, expected a finite number"
    if any(getattr(each, "max", None) is not None for each in _declared(callback, name)):
        return ""
    return fault_of(name, number)


def _declared(callback: Callable[..., Any], name: str) -> tuple[Any, ...]:
    """What a command says of a parameter."""
    annotation = inspect.signature(callback, eval_str=True).parameters[name].annotation
    found: tuple[Any, ...] = getattr(annotation, "__metadata__", ())
    return found


def _spelled(callback: Callable[..., Any], name: str) -> str:
    """What the command line calls an option, or an argument."""
    for each in _declared(callback, name):
        if isinstance(each, typer.models.ArgumentInfo):
            return name
        for stated in (getattr(each, "default", None), *(getattr(each, "param_decls", None) or ())):
            if isinstance(stated, str) and stated.startswith("--"):
                return stated
    return f"--{name.replace('_', '-')}"
