"""The whole system as rows: every topic, who publishes and receives it, at what rate, in which process."""

from collections.abc import Iterable
from dataclasses import dataclass

from groundstation.declarations.calls import calling
from groundstation.declarations.fix import PoseFix
from groundstation.declarations.message import Message
from groundstation.declarations.node import FLIGHT
from groundstation.declarations.part import Part
from groundstation.declarations.rig import Rig
from groundstation.declarations.tables import Tables
from groundstation.parts.table import installed_tables
from groundstation.rig.plan import make_nodes, ports_of

HEADINGS = ("part", "topic", "rate", "published by", "in process", "received by")
RUNNER = "the runner"
PAGE = """# Parts and topics

What the parts declare, whether or not a rig uses it; `*` stands for the name of a vehicle.
`groundstation parts RIG` prints the same for one rig: what it uses, and in which process.

This page is made by `groundstation parts --markdown > docs/parts.md`. Change the parts, not the page.
"""
OF_RUNNERS = frozenset({"journal", "latency"})


@dataclass(frozen=True, slots=True)
class TopicRow:
    """One topic.

    Attributes:
        part: Its part, empty for those of the runners.
        noun: Of the topic.
        rate_hz: Nominal, 0 where it comes by event.
        latched: Whether the last value reaches late joiners.
        publishers: Nodes and ports.
        processes: Of the publishers.
        receivers: Nodes, those of other processes marked with their process.
    """

    part: str
    noun: str
    rate_hz: float
    latched: bool
    publishers: tuple[str, ...]
    processes: tuple[str, ...]
    receivers: tuple[str, ...]

    def cells(self) -> tuple[str, ...]:
        """As shown."""
        rate = f"{self.rate_hz:g}/s" if self.rate_hz else "latched" if self.latched else "by event"
        publishers = ", ".join(self.publishers)
        return self.part, self.noun, rate, publishers, ", ".join(self.processes), ", ".join(self.receivers)


@dataclass(frozen=True, slots=True)
class Overview:
    """Parts and topics of a system.

    Attributes:
        rig: Name of the rig, empty for all that parts declare.
        parts: In the order of the table.
        rows: Topics, in the order of the parts.
    """

    rig: str
    parts: tuple[Part, ...]
    rows: tuple[TopicRow, ...]


@dataclass(frozen=True, slots=True)
class _Spot:
    name: str
    process: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def overview(rig: Rig | None) -> Overview:
    """The system of a rig; without one everything that the parts declare."""
    tables = installed_tables() if rig is None else rig.tables
    spots = list(_declared(tables) if rig is None else _placed(rig))
    rows = []
    for noun, kind in tables.payloads.items():
        makers = [spot for spot in spots if noun in spot.outputs]
        takers = [spot for spot in spots if noun in spot.inputs]
        homes = {spot.process for spot in makers}
        topic = kind.TOPIC
        rows.append(
            TopicRow(
                tables.owner(kind),
                noun,
                topic.rate_hz,
                topic.latched,
                _once(spot.name for spot in makers) or (RUNNER if noun in OF_RUNNERS else "-",),
                _once(spot.process for spot in makers),
                _once(
                    spot.name if spot.process in homes else f"{spot.name} ({spot.process})" for spot in takers
                ),
            )
        )
    return Overview("" if rig is None else rig.name, tuple(tables.parts.values()), tuple(rows))


def _declared(tables: Tables) -> Iterable[_Spot]:
    """Nodes and ports of all parts, by their classes."""
    homes = {}
    for row in tables.nodes.values():
        with calling(tables.part_of(row).title, f"kind of node {row.name!r}"):
            kind = row.node_class()
        template = row.process if isinstance(row.process, str) else FLIGHT
        homes[row.name] = template.replace("{vehicle}", "*")
        fixes = tuple(source.payload for source in tables.fix_sources.values())
        inputs = (each for found in kind.inputs for each in (fixes if found is PoseFix else (found,)))
        yield _Spot(row.name, homes[row.name], _nouns(inputs), _nouns(kind.outputs))
    for port in tables.ports:
        yield _Spot("a port", homes[port.node], (), (port.kind.reads.TOPIC.noun,))


def _placed(rig: Rig) -> Iterable[_Spot]:
    """Nodes and ports of a rig; names of vehicles are left out, since all are alike."""
    for (row, vehicle, process), node in make_nodes(rig):
        yield _Spot(row.name, _plain(process, vehicle), _nouns(node.inputs), _nouns(node.outputs))
    for port, process in ports_of(rig):
        channel = _plain(port.channel, port.vehicle)
        yield _Spot(f"port {channel}", _plain(process, port.vehicle), (), (port.reads.TOPIC.noun,))


def _nouns(kinds: Iterable[type[Message]]) -> tuple[str, ...]:
    return tuple(kind.TOPIC.noun for kind in kinds)


def _plain(name: str, vehicle: str) -> str:
    return name.replace(vehicle, "*", 1) if vehicle else name


def _once(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))


def as_markdown(view: Overview) -> str:
    """A page of the documentation."""
    lines = [f"# Parts and topics of {view.rig}", ""] if view.rig else [*PAGE.splitlines(), ""]
    lines += ["| part | what it does |", "| --- | --- |"]
    lines += [f"| `{part.name}` | {part.summary} |" for part in view.parts]
    lines += ["", f"| {' | '.join(HEADINGS)} |", f"| {' | '.join('---' for _ in HEADINGS)} |"]
    for row in view.rows:
        cells = " | ".join(row.cells()).replace("*", r"\*")  # Markdown would take two of them for emphasis
        lines.append(f"| {cells} |")
    return "\n".join(lines) + "\n"
