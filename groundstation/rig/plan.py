"""Which process runs what, and where its ports are opened: read from the rig and the tables of its parts."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from groundstation.declarations.calls import calling
from groundstation.declarations.checks import check_node
from groundstation.declarations.errors import RigError, UsageError
from groundstation.declarations.message import Message
from groundstation.declarations.names import OF_THE_BUS, process_trouble
from groundstation.declarations.node import COMMANDS, Node, NodeRow, Weight
from groundstation.declarations.port import Port
from groundstation.declarations.rig import LABORATORY, STATION_CHANNEL, Rig
from groundstation.declarations.topic import Scope


class Placed(NamedTuple):
    """A node of a rig and its process."""

    row: NodeRow
    vehicle: str
    process: str

    @property
    def key(self) -> str:
        """As in journals."""
        return self.row.key(self.vehicle)


class PlacedPort(NamedTuple):
    """A port of a rig and its process."""

    port: Port
    process: str


def nodes_of(rig: Rig, process: str | None = None) -> list[Placed]:
    """The nodes of a process, or of all processes if None, in the order of the tables."""
    found = []
    for row in rig.tables.nodes.values():
        part = rig.tables.part_of(row)
        with calling(part.title, f"condition of node {row.name!r}"):
            vehicles = row.vehicles(rig)
        with calling(part.title, f"process of node {row.name!r}"):
            found += [Placed(row, vehicle, row.home(rig, vehicle)) for vehicle in vehicles]
    return found if process is None else [placed for placed in found if placed.process == process]


def ports_of(rig: Rig) -> list[PlacedPort]:
    """Every edge that the rig names, each in the process of the node that reads it."""
    return list(_ports(rig))


def _ports(rig: Rig) -> Iterator[PlacedPort]:
    homes: dict[str, dict[str, str]] = {}
    for placed in nodes_of(rig):
        homes.setdefault(placed.row.name, {})[placed.vehicle] = placed.process
    for row in rig.tables.ports:
        title = rig.tables.part_of(row).title
        where = f"the port of node {row.node!r}"
        readers = homes.get(row.node, {})
        for vehicle in [""] if row.is_of_rig else readers:
            with calling(title, f"make of {where}"):
                port = row.make(rig, vehicle)
            if port is None:
                continue
            if not isinstance(port, Port) or not isinstance(port.channel, str):
                raise RigError(f"{title}: {where} is made as {port!r:.80}, expected a Port with its channel")
            if not readers:
                raise RigError(f"{title}: {port.channel} is read by {row.node!r}, which no vehicle has")
            yield PlacedPort(port, readers.get(vehicle) or next(iter(readers.values())))


def make_node(rig: Rig, key: str) -> Node:
    """Build the node of a journal's key.

    Raises:
        KeyError: The rig has no such node.
        UsageError: Its part makes what no runner could run.
    """
    for placed in nodes_of(rig):
        if placed.key == key:
            return made(rig, placed)
    raise KeyError(key)


def made(rig: Rig, placed: Placed) -> Node:
    """Build a node of the rig.

    Raises:
        UsageError: Its part makes what no runner could run.
        ValueError: It refuses its configuration.
    """
    row, title, payloads = placed.row, rig.tables.part_of(placed.row).title, rig.tables.payloads.values()
    with calling(title, f"make of node {row.name!r}"):
        node = row.make(rig, placed.vehicle)
        kind = row.node_class()  # where its module is named only, it has been imported by now
    check_node(title, placed.key, placed.vehicle, node, payloads, rig.vehicles)
    if not isinstance(node, kind):
        raise UsageError(
            f"{title}: node {placed.key!r} is a {type(node).__name__}, its row says {row.kind!r:.80}"
        )
    return node


def make_nodes(rig: Rig, process: str | None = None) -> list[tuple[Placed, Node]]:
    """Build the nodes of a process, or of all processes if None, in the order of the tables.

    Raises:
        UsageError: A part makes what no runner could run, or two publish the same topic of one owner.
        ValueError: A node refuses its configuration.
    """
    found = [(placed, made(rig, placed)) for placed in nodes_of(rig, process)]
    if process is None:
        _check_publishers(rig, [(placed, node.outputs) for placed, node in found])
    return found


def _check_publishers(rig: Rig, nodes: Iterable[tuple[Placed, tuple[type[Message], ...]]]) -> None:
    """Refuse two nodes, or a node and a port, that publish one topic of one vehicle or of the rig."""
    first: dict[tuple[str, str], str] = {}
    makers = [
        (kind, placed.vehicle, f"node {placed.key!r} of {rig.tables.part_of(placed.row).title}")
        for placed, outputs in nodes
        for kind in dict.fromkeys(outputs)
    ]
    makers += [(port.reads, port.vehicle, f"port {port.channel!r}") for port, _ in ports_of(rig)]
    for kind, vehicle, name in makers:
        if kind.TOPIC.scope is Scope.PROCESS:
            continue
        owner = "" if kind.TOPIC.scope is Scope.RIG else vehicle
        other = first.setdefault((kind.TOPIC.noun, owner), name)
        if other != name:
            raise UsageError(f"{other} and {name} both publish {kind.TOPIC.noun}: a topic has one publisher")


def processes_of(rig: Rig) -> list[str]:
    """Names of the processes that run nodes or ports, commands first; the recorder is not among them."""
    names = {placed.process for placed in nodes_of(rig)} | {placed.process for placed in ports_of(rig)}
    return sorted(names, key=lambda name: (name != COMMANDS, name))


def gives_way(rig: Rig, process: str) -> bool:
    """Whether a process may wait for others on a busy machine: it has heavy nodes (then no urgent ones)."""
    return any(placed.row.weight is Weight.HEAVY for placed in nodes_of(rig, process))


def check_plan(rig: Rig) -> None:
    """Refuse a rig whose nodes cannot be placed.

    Raises:
        RigError: An unknown node, a heavy node together with an urgent one, a process that is named like a
            vehicle or like one of the ground station's own.
        UsageError: Two nodes publish the same topic of one owner.
    """
    known = rig.tables.nodes
    for name in rig.nodes:
        if name not in known:
            raise RigError(f"nodes.{name}: no such node (there are {', '.join(known)})")
    inside: dict[str, dict[Weight, str]] = {}
    for placed in nodes_of(rig):
        inside.setdefault(placed.process, {}).setdefault(placed.row.weight, placed.row.name)
    for process, weights in inside.items():
        if Weight.HEAVY in weights and Weight.URGENT in weights:
            heavy, urgent = weights[Weight.HEAVY], weights[Weight.URGENT]
            raise RigError(
                f"process '{process}' holds {heavy}, which is heavy, beside {urgent}, which must not wait"
            )
    for placed in nodes_of(rig):
        trouble = process_trouble(placed.process)
        if trouble:
            given = rig.nodes.get(placed.row.name)
            where = f"nodes.{placed.row.name}.process"
            if given is None or given.process is None:
                where = f"{rig.tables.part_of(placed.row).title}: the process of node {placed.row.name!r}"
            raise RigError(f"{where}: {trouble}")
    kinds = [(placed, placed.row.kind) for placed in nodes_of(rig)]
    _check_publishers(rig, [(placed, kind.outputs) for placed, kind in kinds if not isinstance(kind, str)])
    clash = set(processes_of(rig)) & set(rig.vehicles)
    if clash:
        raise RigError(f"'{clash.pop()}' names both a vehicle and a process: choose another vehicle name")
    taken = OF_THE_BUS & set(rig.vehicles)
    if taken:
        raise RigError(f"'{min(taken)}' has a meaning on the bus: choose another vehicle name")


def laboratory_ports(rig: Rig, channels: Collection[str] | Mapping[str, str]) -> list[Port]:
    """The rig's ports under the names that its laboratory gives their channels, for virtual time.

    Args:
        rig: The rig.
        channels: Of the laboratory, with what each carries.

    Raises:
        RigError: The laboratory has no such channel, it carries something else, or a device is real.
    """
    found = []
    for port, _ in ports_of(rig):
        address = port.address
        if isinstance(address, str) and address.startswith(STATION_CHANNEL):
            continue
        if not isinstance(address, str) or not address.startswith(LABORATORY):
            raise RigError(f"{port.channel}: {address!r} is real hardware, which runs in real time only")
        channel = address.removeprefix(LABORATORY)
        if port.is_optional and channel not in channels:
            continue
        _check_channel(channel, channels)
        kind = channels[channel] if isinstance(channels, Mapping) else port.carries
        if port.carries not in ("", kind):
            raise RigError(
                f"{port.channel}: {address!r} carries {kind} in this laboratory, expected {port.carries}: "
                "give the address of another channel"
            )
        found.append(replace(port, channel=channel))
    return found


def resolved_ports(rig: Rig, process: str, addresses: Mapping[str, object]) -> list[Port]:
    """The ports of a process, ``laboratory:`` addresses replaced by what the laboratory announced.

    Raises:
        RigError: The laboratory has no such channel.
    """
    found = []
    for port, home in ports_of(rig):
        if home != process:
            continue
        address = port.address
        if isinstance(address, str) and address.startswith(STATION_CHANNEL):
            address = addresses[address]
        elif isinstance(address, str) and address.startswith(LABORATORY):
            channel = address.removeprefix(LABORATORY)
            if port.is_optional and channel not in addresses:
                continue
            _check_channel(channel, addresses)
            address = addresses[channel]
        found.append(replace(port, address=address))
    return found


def _check_channel(channel: str, known: Collection[str]) -> None:
    if channel not in known:
        raise RigError(f"the laboratory has no channel {channel!r} (it has: {', '.join(sorted(known))})")
