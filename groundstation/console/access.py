"""Who may look and who may ask: roles, tokens, and what a page of somebody else's must not do.

On loopback everybody at this machine is an operator. For a network the console wants TLS and a token: one
for observers, one for operators. In both cases a request counts only if it was made by a page of this server:
its ``Host`` must be an address that the server goes by (a foreign name that resolves to it is refused, DNS
rebinding), and an ``Origin``, which browsers add to what other pages make them send, must be the same.
"""

import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from urllib.parse import urlsplit

LOOPBACK = ("127.0.0.1", "localhost", "::1")
COOKIE = "groundstation_access"


class Role(IntEnum):
    """What somebody may do; each may do what those below may."""

    NOBODY = 0
    OBSERVER = 1
    OPERATOR = 2


@dataclass(frozen=True)
class Access:
    """How the console is reached.

    Attributes:
        host: Address that it listens at.
        port: Likewise.
        names: Further names of it, as its certificate has them.
        observer: Token of those who look on; empty on loopback.
        operator: Token of those who fly; empty on loopback.
        certificate: PEM file; empty on loopback.
        key: PEM file of its private key.
    """

    host: str = "127.0.0.1"
    port: int = 8400
    names: tuple[str, ...] = ()
    observer: str = field(default="", repr=False)
    operator: str = field(default="", repr=False)
    certificate: str = ""
    key: str = ""

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine reaches it."""
        return self.host in LOOPBACK

    @property
    def scheme(self) -> str:
        """Of its addresses."""
        return "https" if self.certificate else "http"

    @property
    def address(self) -> str:
        """What a person opens."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}/"

    @property
    def greeting(self) -> tuple[str, ...]:
        """What is printed for people: an address to open, one for each role where there are two."""
        if not self.operator:
            return (f"console: {self.address}",)
        return (
            f"console: {self.address}?token={self.operator}",
            f"console, for those who look on: {self.address}?token={self.observer}",
        )

    def trouble(self) -> str:
        """Why it must not be opened so; empty if it may."""
        if self.is_loopback:
            return ""
        if not (self.certificate and self.key):  # first: who has certificates is given tokens
            return f"a console at {self.host} needs TLS: make certificates with `groundstation certificates`"
        if not (self.observer and self.operator):
            return f"a console at {self.host} needs tokens: nobody may fly who merely reaches it"
        return ""

    def role(self, headers: Mapping[str, str], cookie: str, token: str) -> Role:
        """Who asks.

        Args:
            headers: Of the request, names in small letters.
            cookie: What the browser keeps from an address with a token.
            token: Of the address.
        """
        if not self.operator:
            return Role.OPERATOR
        bearer = headers.get("authorization", "").removeprefix("Bearer ").strip()
        for given in (bearer, token, cookie):
            if given and secrets.compare_digest(given.encode(), self.operator.encode()):
                return Role.OPERATOR
            if given and secrets.compare_digest(given.encode(), self.observer.encode()):
                return Role.OBSERVER
        return Role.NOBODY

    def foreign(self, headers: Mapping[str, str]) -> str:
        """Why a request was not made by a page of this server, a sentence; empty if it may have been."""
        host = headers.get("host", "")
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return f"{host!r:.60} is no address of this console"
        known = (*LOOPBACK, self.host, *self.names)
        if name not in known and self.host not in ("0.0.0.0", "::"):
            return f"this console does not go by the name {name!r:.60}"
        origin = headers.get("origin", "")
        if origin and origin != f"{self.scheme}://{host}":
            return f"a page of {origin!r:.60} may not ask anything of this console"
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
            return "a page of somebody else may not ask anything of this console"
        return ""


def new_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_urlsafe(18)
