"""Addresses of the form ``socket://host:port``, which pyserial opens but refuses in words of its own."""

from urllib.parse import urlsplit

from drivers.errors import Refused

_SCHEME = "socket://"
_HIGHEST_PORT = 65535


def check_socket_url(url: str) -> None:
    """Refuse a socket's address that lacks its host or its port; other addresses pass.

    Raises:
        Refused: It does, or the port is none.
    """
    if not url.startswith(_SCHEME):
        return
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError:  # a port that is no number, or above 65535
        host, port = "", None
    if not host or not port:
        raise Refused(
            f"{url} is no address of a socket: expected socket://HOST:PORT, PORT 1 to {_HIGHEST_PORT}"
        )
