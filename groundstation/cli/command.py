"""What a command of the command line is: where it lives, and the line that an overview shows.

A package adds a command by an entry point of the group ``groundstation.commands`` that names a
``Command`` or ``Group``. The module of that object is imported for every overview: it should hold nothing
else, as ``calibration.commands`` does. What a command needs is imported when it is called.
"""

from collections.abc import Mapping
from typing import NamedTuple


class Command(NamedTuple):
    """A command.

    Attributes:
        target: ``module:attribute`` of a function with typer's annotations, or of a ``typer.Typer``.
        summary: One line.
    """

    target: str
    summary: str


class Group(NamedTuple):
    """Commands under one word.

    Attributes:
        summary: One line.
        example: A call.
        members: Commands by name.
    """

    summary: str
    example: str
    members: Mapping[str, Command]
