"""Which addresses processes listen on, as the kernel lists them."""

import contextlib
import ipaddress
import re
from pathlib import Path

LISTENING = {"tcp": "0A", "tcp6": "0A", "udp": "07", "udp6": "07"}
"""States in the tables of ``/proc/net``: listening, and for UDP bound to whoever sends."""


def inodes_of(pid):
    """Sockets that a process holds."""
    found = set()
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        for entry in Path(f"/proc/{pid}/fd").iterdir():
            with contextlib.suppress(FileNotFoundError):
                match = re.fullmatch(r"socket:\[(\d+)\]", str(entry.readlink()))
                if match:
                    found.add(match[1])
    return found


def address_of(text):
    """An address as the kernel writes it: words of 32 bits of the host's byte order, and a port."""
    digits, port = text.split(":")
    words = [bytes.fromhex(digits[start : start + 8])[::-1] for start in range(0, len(digits), 8)]
    return ipaddress.ip_address(b"".join(words)), int(port, 16)


def listened_on(pids):
    """Protocol, address and port of everything that processes listen on."""
    inodes = set().union(*map(inodes_of, pids))
    found = []
    for protocol, state in LISTENING.items():
        for line in Path(f"/proc/net/{protocol}").read_text().splitlines()[1:]:
            columns = line.split()
            if columns[3] == state and columns[9] in inodes:
                found.append((protocol, *address_of(columns[1])))
    return found


def is_loopback(address):
    """Whether only this host reaches it."""
    mapped = getattr(address, "ipv4_mapped", None)
    return (mapped or address).is_loopback
