"""What runs beside a rig where it is asked for: bridges, and guests of other hosts on the bus."""

import re
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from groundstation.bridges import foxglove, ros2
from groundstation.declarations.errors import UsageError
from groundstation.launch.attendant import Attendant
from groundstation.launch.guests import DEFAULT_PORT, Guests
from groundstation.launch.listening import check_listening, listening

LOOPBACK = "127.0.0.1"


class Beside(NamedTuple):
    """Attributes of what runs beside a rig.

    Attributes:
        bridges: To other programs.
        guests: Where other hosts connect; None: nowhere.
    """

    bridges: tuple[Attendant, ...]
    guests: Guests | None


def beside_of(
    foxglove_port: int | None,
    router: str | None,
    domain: int,
    guests: str | None,
    certificates: Path | None,
    *,
    is_live: bool,
) -> Beside:
    """What the command line asks for, checked before anything starts.

    Args:
        foxglove_port: Where Foxglove is served; None: not at all.
        router: Of ROS 2; None for no bridge.
        domain: Of ROS 2.
        guests: Address, or address and port, of this host; None for none.
        certificates: Folder of the certificates.
        is_live: Real time.

    Raises:
        UsageError: It cannot be done.
    """
    if not is_live and not (foxglove_port is None and router is None and guests is None):
        raise UsageError(
            "--foxglove, --ros2 and --guests go with real time: in virtual time nobody could look on"
        )
    bridges = []
    if foxglove_port is not None:
        foxglove.check_installed()
        bridges.append(foxglove.attendant(check_listening(foxglove.HOST, foxglove_port, "--foxglove-port")))
    if router is not None:
        if not _is_router(router):
            raise UsageError(f"--ros2 is {router!r}, expected a router such as tcp/127.0.0.1:7447")
        bridges.append(ros2.attendant(ros2.Told(router, domain)))
    return Beside(tuple(bridges), None if guests is None else _guests(guests, certificates))


def check_ports(hub_port: int, guests: Guests | None, foxglove_port: int | None) -> None:
    """Refuse ports that cannot be listened on, or of which two are one and the same.

    Args:
        hub_port: On loopback; 0 for a free one.
        guests: Where other hosts connect; None: nowhere.
        foxglove_port: Where Foxglove is served; None: not at all.

    Raises:
        UsageError: It names the option.
    """
    with ExitStack() as held:
        if hub_port:
            held.enter_context(listening(LOOPBACK, hub_port, "--hub-port"))
        if guests is not None:
            held.enter_context(listening(guests.address, guests.port, "--guests"))
        if foxglove_port:
            held.enter_context(listening(foxglove.HOST, foxglove_port, "--foxglove-port"))


def _is_router(asked: str) -> bool:
    """Whether it is an endpoint that Zenoh can connect to: a protocol, a host and a port."""
    protocol, _, rest = asked.partition("/")
    host, _, port = re.split(r"[?#]", rest, maxsplit=1)[0].rpartition(":")  # settings come behind
    is_host = re.fullmatch(r"\[[^\s/\[\]]+\]|[^\s:/\[\]]+", host) is not None and host.isprintable()
    return protocol in ("tcp", "udp", "tls", "quic", "ws") and is_host and _is_port(port)


def _is_port(word: str) -> bool:
    return word.isascii() and word.isdecimal() and len(word) <= 5 and 0 < int(word) < 65536


def _guests(asked: str, certificates: Path | None) -> Guests:
    """Where other hosts connect.

    Raises:
        UsageError: It is no address, or certificates are missing.
    """
    address, colon, port = asked.rpartition(":")
    if not colon or asked.endswith("]") or (asked.count(":") > 1 and not asked.startswith("[")):
        address, port = asked, str(DEFAULT_PORT)
    if not (_is_port(port) and address):
        raise UsageError(f"--guests is {asked!r}, expected an address such as 0.0.0.0 or 192.168.1.20:7449")
    if certificates is None:
        raise UsageError("--guests wants --guests-certificates, which `groundstation certificates` makes")
    made = Guests(address.strip("[]"), int(port), certificates)
    made.check()
    return made
