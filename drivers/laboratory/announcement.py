"""The line by which a started laboratory announces where its channels can be opened."""

import json
from collections.abc import Mapping

Address = str | Mapping[str, object]
"""Where a channel is opened: a device path or URL, or keyword arguments of its port (CAN, motion capture)."""


def encode_announcement(addresses: Mapping[str, Address]) -> str:
    r"""One line for stdout: `{"announce": {"alpha/imu": "/dev/pts/3", ...}}`, ended by a newline.

    Args:
        addresses: Channel to where it is opened: a path or URL, or a table of keyword arguments for the
            valve bus, such as `{"interface": "slcan", "channel": "socket://127.0.0.1:4000"}`.
    """
    return (
        json.dumps({"announce": {channel: _plain(address) for channel, address in addresses.items()}}) + "\n"
    )


def _plain(address: Address) -> object:
    return address if isinstance(address, str) else dict(address)


def parse_announcement(line: str) -> dict[str, Address] | None:
    """The addresses of an announcement line; None for any other line, which is log output.

    Raises:
        ValueError: The line states `announce` but not in the documented form.
    """
    try:
        reported = json.loads(line)
    except ValueError:
        return None
    if not isinstance(reported, dict) or "announce" not in reported:
        return None
    addresses = reported["announce"]
    if not isinstance(addresses, dict):
        raise ValueError(f"an announcement maps channels to addresses, got {type(addresses).__name__}")
    for channel, address in addresses.items():
        if not isinstance(address, str | dict):
            raise ValueError(f"announced address of {channel!r} is neither a text nor a table: {address!r}")
    return addresses
