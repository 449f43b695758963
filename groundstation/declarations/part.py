"""What a part of the system is: one folder with one declaration."""

from collections.abc import Callable
from dataclasses import dataclass

from groundstation.declarations.fix import FixSource
from groundstation.declarations.message import Message
from groundstation.declarations.node import NodeRow
from groundstation.declarations.port import PortRow
from groundstation.declarations.request import Action
from groundstation.declarations.rig import Rig
from groundstation.declarations.section import Section
from groundstation.declarations.view import Figure, GaugeRow


def nothing_to_check(rig: Rig) -> None:
    """Accept every rig."""
    del rig


@dataclass(frozen=True, slots=True)
class Part:
    """Everything that a part adds to the system; the tables are the concatenation of all parts.

    Attributes:
        name: Of the part, as its folder is called.
        summary: One line for people.
        topics: Payload classes that it publishes or that arrive at its ports.
        nodes: Its nodes.
        ports: Its edges.
        actions: What can be requested of a vehicle through it.
        fix_sources: Kinds of fixes that it makes.
        rig: Keys that it adds to the rig itself.
        mock_up: Keys that it adds to a type of mock-up.
        vehicle: Keys that it adds to a vehicle.
        check: Refuses a rig with a ValueError that begins with the key.
        gauges: Its rows of the live view.
        figures: Its numbers in the report.
        package: Installed package that it comes from; empty for the tree's own, filled in when it is loaded.
    """

    name: str
    summary: str
    topics: tuple[type[Message], ...] = ()
    nodes: tuple[NodeRow, ...] = ()
    ports: tuple[PortRow, ...] = ()
    actions: tuple[Action, ...] = ()
    fix_sources: tuple[FixSource, ...] = ()
    rig: type[Section] | None = None
    mock_up: type[Section] | None = None
    vehicle: type[Section] | None = None
    check: Callable[[Rig], None] = nothing_to_check
    gauges: tuple[GaugeRow, ...] = ()
    figures: tuple[Callable[[], Figure], ...] = ()
    package: str = ""

    @property
    def title(self) -> str:
        """As sentences name it."""
        return f"the part {self.name!r}" + (f" of the package {self.package}" if self.package else "")
