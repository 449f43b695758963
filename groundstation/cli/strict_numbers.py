"""Numbers on the command line are numbers: infinity and NaN are refused wherever a command takes one."""

import inspect
import math
from collections.abc import Callable
from functools import wraps
from typing import Any

import typer

from groundstation.declarations.errors import UsageError


def check_numbers(app: typer.Typer) -> None:
    """Let every command of an app, and of the groups in it, refuse what is no finite number."""
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
            if isinstance(value, float) and not math.isfinite(value):
                raise UsageError(f"{_spelled(callback, name)} is {value}, expected a finite number")
        return callback(**given)

    return checked


def _spelled(callback: Callable[..., Any], name: str) -> str:
    """What the command line calls an option."""
    annotation = inspect.signature(callback, eval_str=True).parameters[name].annotation
    for each in getattr(annotation, "__metadata__", ()):
        for stated in (getattr(each, "default", None), *(getattr(each, "param_decls", None) or ())):
            if isinstance(stated, str) and stated.startswith("--"):
                return stated
    return f"--{name.replace('_', '-')}"
