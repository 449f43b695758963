"""What runs beside a rig where it is asked for: bridges, and guests of other hosts on the bus."""

import socket
from pathlib import Path
from typing import NamedTuple

from groundstation.bridges import foxglove, ros2
from groundstation.declarations.errors import UsageError
from groundstation.launch.attendant import Attendant
from groundstation.launch.guests import DEFAULT_PORT, Guests


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
        bridges.append(foxglove.attendant(_free(foxglove_port)))
    if router is not None:
        protocol, slash, address = router.partition("/")
        if not (slash and protocol in ("tcp", "udp", "tls", "quic", "ws") and ":" in address):
            raise UsageError(f"--ros2 is {router!r}, expected a router such as tcp/127.0.0.1:7447")
        bridges.append(ros2.attendant(ros2.Told(router, domain)))
    return Beside(tuple(bridges), None if guests is None else _guests(guests, certificates))


def _free(port: int) -> int:
    """The port, or a free one for 0.

    Raises:
        UsageError: Somebody serves on it: the run would begin, and have no server.
    """
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((foxglove.HOST, port))
        except OSError as error:
            raise UsageError(
                f"port {port} of {foxglove.HOST} is taken ({error.strerror}): choose another with "
                "--foxglove-port"
            ) from error
        free: int = probe.getsockname()[1]
        return free


def _guests(asked: str, certificates: Path | None) -> Guests:
    """Where other hosts connect.

    Raises:
        UsageError: It is no address, or certificates are missing.
    """
    address, colon, port = asked.rpartition(":")
    if not colon or asked.endswith("]") or (asked.count(":") > 1 and not asked.startswith("[")):
        address, port = asked, str(DEFAULT_PORT)
    if not (port.isdecimal() and 0 < int(port) < 65536 and address):
        raise UsageError(f"--guests is {asked!r}, expected an address such as 0.0.0.0 or 192.168.1.20:7449")
    if certificates is None:
        raise UsageError("--guests wants --guests-certificates, which `groundstation certificates` makes")
    made = Guests(address.strip("[]"), int(port), certificates)
    made.check()
    return made
