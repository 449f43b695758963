"""Which process runs what, and where its ports are opened: read from the rig and the tables of its parts."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from groundstation.declarations.errors import RigError
from groundstation.declarations.node import COMMANDS, Node, NodeRow, Weight
from groundstation.declarations.port import Port
from groundstation.declarations.rig import LABORATORY, STATION, Rig

RECORDER = "recorder"
NOT_VEHICLES = frozenset({"rig", "record", "alive", "all"})
"""First words of keys on the bus, and of requests, that stand for something else than a vehicle."""


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
    found = [
        Placed(row, vehicle, row.home(rig, vehicle))
        for row in rig.tables.nodes.values()
        for vehicle in row.vehicles(rig)
    ]
    return found if process is None else [placed for placed in found if placed.process == process]


def ports_of(rig: Rig) -> list[PlacedPort]:
    """Every edge that the rig names, each in the process of the node that reads it."""
    return list(_ports(rig))


def _ports(rig: Rig) -> Iterator[PlacedPort]:
    for row in rig.tables.ports:
        node = rig.tables.nodes[row.node]
        vehicles = [""] if row.is_of_rig else node.vehicles(rig)
        for vehicle in vehicles:
            port = row.make(rig, vehicle)
            if port is not None:
                readers = node.vehicles(rig)
                yield PlacedPort(port, node.home(rig, vehicle if vehicle in readers else readers[0]))


def make_node(rig: Rig, key: str) -> Node:
    """Build the node of a journal's key.

    Raises:
        KeyError: The rig has no such node.
    """
    vehicle, _, name = key.rpartition("/")
    row = rig.tables.nodes[name]
    if vehicle not in row.vehicles(rig):
        raise KeyError(key)
    return row.make(rig, vehicle)


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
        RigError: An unknown node, a heavy node together with an urgent one, a process named like a vehicle.
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
    clash = set(processes_of(rig)) & set(rig.vehicles)
    if clash:
        raise RigError(f"'{clash.pop()}' names both a vehicle and a process: choose another vehicle name")
    taken = NOT_VEHICLES & set(rig.vehicles)
    if taken:
        raise RigError(f"'{min(taken)}' has a meaning on the bus: choose another vehicle name")


def laboratory_ports(rig: Rig, channels: Collection[str]) -> list[Port]:
    """The rig's ports under the names that its laboratory gives their channels, for virtual time.

    Raises:
        RigError: The laboratory has no such channel, or a device is real.
    """
    found = []
    for port, _ in ports_of(rig):
        address = port.address
        if isinstance(address, str) and address.startswith(STATION):
            continue
        if not isinstance(address, str) or not address.startswith(LABORATORY):
            raise RigError(f"{port.channel}: {address!r} is real hardware, which runs in real time only")
        channel = address.removeprefix(LABORATORY)
        if port.is_optional and channel not in channels:
            continue
        _check_channel(channel, channels)
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
        if isinstance(address, str) and address.startswith(STATION):
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
