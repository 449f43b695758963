"""Whether a port of this machine can be listened on: found out before anything starts.

Who finds it out later has started half a rig by then, and speaks in the words of a library.
"""

import errno
import socket
from collections.abc import Iterator
from contextlib import contextmanager

from groundstation.declarations.errors import UsageError


def check_listening(host: str, port: int, option: str) -> int:
    """The port, or a free one for 0.

    Args:
        host: Address or name of this machine.
        port: Of TCP.
        option: Of the command line, which would change it.

    Raises:
        UsageError: It cannot be listened on; the sentence names the option.
    """
    with listening(host, port, option) as found:
        return found


@contextmanager
def listening(host: str, port: int, option: str) -> Iterator[int]:
    """Listen while the context lasts: another option that names the same port is refused meanwhile.

    Raises:
        UsageError: As of ``check_listening``.
    """
    try:
        probe = _listen(host, port)
    except (OSError, ValueError) as error:  # a name that no resolver takes is a ValueError
        raise UsageError(_refusal(host, port, option, error)) from error
    with probe:
        found: int = probe.getsockname()[1]
        yield found


def first_free(host: str, first: int, tried: int, option: str) -> int:
    """The first port from here on that can be listened on.

    Args:
        host: Address or name of this machine.
        first: Of TCP.
        tried: How many ports are looked at.
        option: Of the command line, which would change the address.

    Raises:
        UsageError: The address is none of this machine, or no port of it is free.
    """
    last = min(first + tried, 65536) - 1
    for port in range(first, last + 1):
        try:
            _listen(host, port).close()
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise UsageError(_refusal(host, port, option, error)) from error
        except ValueError as error:
            raise UsageError(_refusal(host, port, option, error)) from error
        else:
            return port
    raise UsageError(f"no port from {first} to {last} of {host} is free: begin with another one")


def _listen(host: str, port: int) -> socket.socket:
    family, kind, protocol, _, address = socket.getaddrinfo(
        host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )[0]
    probe = socket.socket(family, kind, protocol)
    try:
        # connections of the last run that are still closing are in nobody's way
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(address)
        probe.listen()
    except BaseException:
        probe.close()
        raise
    return probe


def _refusal(host: str, port: int, option: str, error: OSError | ValueError) -> str:
    why = (error.strerror if isinstance(error, OSError) else "") or str(error)
    if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
        return f"port {port} of {host} is taken: choose another with {option}"
    if isinstance(error, OSError) and error.errno == errno.EACCES:
        return f"port {port} of {host} is not for everybody ({why}): choose one from 1024 on with {option}"
    return f"{host!r} is no address of this machine ({why}): choose one with {option}"
