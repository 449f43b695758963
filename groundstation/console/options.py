"""The console as the launcher knows it: loaded without what only the server needs."""

import os
from dataclasses import dataclass, field

from groundstation.console.access import Access
from groundstation.declarations.names import CONSOLE
from groundstation.launch.attendant import Attendant


@dataclass(frozen=True)
class Options:
    """What the console's process is told.

    Attributes:
        access: How it is reached.
        secret: Of the tokens of control; the same for every life of the console in a run.
    """

    access: Access
    secret: bytes = field(default_factory=lambda: os.urandom(32), repr=False)


def attendant(access: Access) -> Attendant:
    """The console as a process beside a rig's."""
    return Attendant(CONSOLE, "groundstation.console.live:run", Options(access), access.greeting)
