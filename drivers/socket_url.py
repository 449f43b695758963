"""Addresses of the form ``scheme://host:port``, which pyserial opens but refuses in words of its own."""

from urllib.parse import urlsplit

from drivers.errors import Refused

_SCHEMES = ("socket", "rfc2217")
_HIGHEST_PORT = 65535


def check_socket_url(url: str) -> None:
    """Refuse a socket's address that lacks its host or its port; other addresses pass.

    Raises:
        Refused: It does, or the port is none.
    """
    scheme = url.partition("://")[0]
    if "://" not in url or scheme not in _SCHEMES:
        return
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError:  # a port that is no number, or above 65535
        host, port = "", None
    if not host or not port:
        raise Refused(
            f"{url} is no address of a socket: expected {scheme}://HOST:PORT, PORT 1 to {_HIGHEST_PORT}"
        )
