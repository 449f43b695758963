"""The console as the launcher knows it: loaded without what only the server needs."""

import os
from dataclasses import dataclass, field
from pathlib import Path

from groundstation.console.access import Access
from groundstation.declarations.names import CONSOLE
from groundstation.launch.attendant import Attendant


@dataclass(frozen=True)
class Options:
    """What the console's process is told.

    Attributes:
        access: How it is reached.
        scenario: Keys of the scenario's file as JSON, and the file; None where a rig flies.
        secret: Of the tokens of control; the same for every life of the console in a run.
    """

    access: Access
    scenario: tuple[str, Path] | None = None
    secret: bytes = field(default_factory=lambda: os.urandom(32), repr=False)


def attendant(access: Access, scenario: tuple[str, Path] | None = None) -> Attendant:
    """The console as a process beside a rig's, or beside a scenario's."""
    options = Options(access, scenario)
    return Attendant(CONSOLE, "groundstation.console.live:run", options, access.greeting)
