"""Which process runs what, and where its ports are opened: read from rig and node table."""

from collections.abc import Collection, Mapping
from dataclasses import replace

from groundstation.runtime.errors import RigError
from groundstation.runtime.node_table import NODES, Weight, process_of
from groundstation.runtime.ports import PortTranslation, ports_of
from groundstation.runtime.rig import LABORATORY, Rig

RECORDER = "recorder"


def processes_of(rig: Rig) -> list[str]:
    """Names of the processes that run nodes or ports, commands first; the recorder is not among them."""
    names: dict[str, None] = {}
    for row in NODES:
        for vehicle in row.vehicles(rig):
            names[process_of(rig, row, vehicle)] = None
    for port in ports_of(rig):
        names[port.process] = None
    clash = set(names) & set(rig.vehicles)
    if clash:
        raise RigError(f"'{clash.pop()}' names both a vehicle and a process: choose another vehicle name")
    return sorted(names, key=lambda name: (name != "commands", name))


def gives_way(rig: Rig, process: str) -> bool:
    """Whether a process may wait for others on a busy machine: it has heavy nodes (then no urgent ones)."""
    return any(
        row.weight is Weight.HEAVY and process_of(rig, row, vehicle) == process
        for row in NODES
        for vehicle in row.vehicles(rig)
    )


def check_addresses(rig: Rig) -> None:
    """Refuse addresses that no port can be opened with.

    Raises:
        RigError: One sentence with the key.
    """
    bus = rig.valve_bus
    if isinstance(bus, str):
        if not bus.startswith(LABORATORY):
            raise RigError(f"valve_bus: expected a table with 'interface' and 'channel', found {bus!r}")
        if rig.laboratory is None:
            raise RigError(f"valve_bus: {bus!r} needs a [laboratory] section")
        return
    for key in ("interface", "channel"):
        if key not in bus:
            raise RigError(f"valve_bus: the key {key!r} is missing")


def laboratory_ports(rig: Rig, channels: Collection[str]) -> list[PortTranslation]:
    """The rig's ports under the names that its laboratory gives their channels, for virtual time.

    Raises:
        RigError: The laboratory has no such channel, or a device is real.
    """
    found = []
    for port in ports_of(rig):
        address = port.address
        if not isinstance(address, str) or not address.startswith(LABORATORY):
            raise RigError(f"{port.channel}: {address!r} is real hardware, which runs in real time only")
        channel = address.removeprefix(LABORATORY)
        _check_channel(channel, channels)
        found.append(replace(port, channel=channel))
    return found


def resolved_ports(rig: Rig, addresses: Mapping[str, object]) -> list[PortTranslation]:
    """The rig's ports, ``laboratory:`` addresses replaced by what the laboratory announced.

    Raises:
        RigError: The laboratory has no such channel.
    """
    found = []
    for port in ports_of(rig):
        address = port.address
        if isinstance(address, str) and address.startswith(LABORATORY):
            channel = address.removeprefix(LABORATORY)
            _check_channel(channel, addresses)
            address = addresses[channel]
        found.append(replace(port, address=address))
    return found


def _check_channel(channel: str, known: Collection[str]) -> None:
    if channel not in known:
        raise RigError(f"the laboratory has no channel {channel!r} (it has: {', '.join(sorted(known))})")
