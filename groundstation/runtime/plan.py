"""Which process runs what, and where its ports are opened: read from rig and node table."""

from collections.abc import Mapping
from dataclasses import replace

from groundstation.runtime.errors import RigError
from groundstation.runtime.node_table import NODES, process_of
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
            if channel not in addresses:
                known = ", ".join(sorted(addresses)) or "none"
                raise RigError(f"the laboratory has no channel {channel!r} (it has: {known})")
            address = addresses[channel]
        found.append(replace(port, address=address))
    return found
