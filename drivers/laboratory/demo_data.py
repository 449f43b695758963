"""What an emulated laboratory offers for trying commands: folders of every kind, with the truth beside."""

from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path
from typing import NamedTuple

from drivers.errors import NotFound

DEMO_DATA_GROUP = "groundstation.demo_data"
"""Entry points that name a tuple of ``DemoKind``."""


class DemoKind(NamedTuple):
    """A kind of folder.

    Attributes:
        name: Of the folder.
        summary: What it holds.
        commands: What can be tried on it: words behind ``groundstation``; ``{here}`` is the folder.
        make: Fills an empty folder; the seed decides it all.
    """

    name: str
    summary: str
    commands: tuple[str, ...]
    make: Callable[[Path, int], None]


def demo_kinds() -> tuple[DemoKind, ...]:
    """Every kind that an installed package offers, in their order.

    Raises:
        NotFound: None is offered, or one cannot be loaded.
    """
    found: list[DemoKind] = []
    for point in sorted(entry_points(group=DEMO_DATA_GROUP), key=lambda point: point.name):
        try:
            found += point.load()
        except (Exception, SystemExit) as error:  # whatever a package of somebody else raises: it is named
            raise NotFound(f"demo data {point.value} cannot be loaded: {error}") from error
    if not found:
        raise NotFound("no installed package offers demo data")
    return tuple(found)
