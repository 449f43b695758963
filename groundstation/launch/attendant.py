"""A process beside those of the rig: a console, a bridge. It watches a flight and asks things of it.

No flight waits for one, and none ends with one: an attendant that dies is started again, one that cannot do
what it is told is given up with its reason.
"""

import importlib
from dataclasses import dataclass, field

from groundstation.launch.orders import Orders


@dataclass(frozen=True)
class Attendant:
    """What the launcher is to run besides.

    Attributes:
        name: Of the process.
        target: ``module:function``, called with its orders; imported in the process itself, so that neither
            the launcher nor the processes of the rig load what only it needs.
        options: What it is told; pickled.
        greeting: What people are told once it is ready.
    """

    name: str
    target: str
    options: object = field(default=None, repr=False)
    greeting: tuple[str, ...] = ()


def run(orders: Orders) -> None:
    """Run an attendant; what the fork server calls. What it cannot do it says in a sentence, and ends."""
    from groundstation.launch.process import obey  # much, and of this process alone

    assert orders.attendant is not None
    module, _, function = orders.attendant.target.partition(":")
    obey(getattr(importlib.import_module(module), function), orders)
