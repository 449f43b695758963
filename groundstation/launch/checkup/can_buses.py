"""CAN interfaces of the system: whether they are there, up, and free of errors."""

from collections.abc import Iterator

from groundstation.launch.checkup.finding import Finding, Machine, bad, ok, warn

_NET = "sys/class/net"
_CAN_TYPE = "280"  # ARPHRD_CAN, <linux/if_arp.h>
_UP = 0x1  # IFF_UP, <linux/if.h>
BITRATE = 500_000


def interfaces(machine: Machine) -> list[str]:
    """Names of all CAN interfaces."""
    found = sorted(path.name for path in machine.at(_NET).glob("*"))
    return [name for name in found if machine.text(f"{_NET}/{name}/type") == _CAN_TYPE]


def can_bus(machine: Machine, subject: str, name: str, bitrate: int = BITRATE) -> Iterator[Finding]:
    """An interface by its name."""
    kind = machine.text(f"{_NET}/{name}/type")
    if kind is None:
        known = interfaces(machine)
        yield bad(
            subject,
            f"there is no interface {name}" + (f" (there are {', '.join(known)})" if known else ""),
            "plug the adapter in; `ip link` lists what there is",
        )
        return
    if kind != _CAN_TYPE:
        yield bad(subject, f"{name} is no CAN interface", "correct valve_bus in the rig file")
        return
    flags = machine.text(f"{_NET}/{name}/flags") or "0"
    if not int(flags, 16) & _UP:
        yield bad(subject, f"{name} is down", f"sudo ip link set {name} up type can bitrate {bitrate}")
        return
    counts = {way: machine.text(f"{_NET}/{name}/statistics/{way}_errors") or "0" for way in ("rx", "tx")}
    if any(count != "0" for count in counts.values()):
        yield warn(
            subject,
            f"{name} is up, with {counts['rx']} errors received and {counts['tx']} sent",
            "check bit rate, both terminations of 120 ohm and the plugs; count again after a minute",
        )
    else:
        yield ok(subject, f"{name} is up, without errors")
