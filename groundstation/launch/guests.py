"""Programs of other hosts on the bus: who may connect, and what each may do there.

They come over TLS with a certificate of the rig's own authority; its common name is a role. What may come
from outside is less than what this host's own processes may: no role may publish a state, a ruling or a valve
command, and nobody outside may write another process's record stream.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from groundstation.declarations.errors import UsageError

OBSERVER, OPERATOR = "observer", "operator"
MAY_PUBLISH: Mapping[str, tuple[str, ...]] = {
    OBSERVER: (),
    OPERATOR: (
        "outside/*/wrench",
        "outside/*/request",
        "operator_$*/request",
        "operator_$*/stop_press",
        "record/operator_$*",
    ),
}
"""Keys on which a role may publish; it may receive everything."""
ROLES = tuple(MAY_PUBLISH)
DEFAULT_PORT = 7449
FILES = ("ca.pem", "server.pem", "server.key")


@dataclass(frozen=True)
class Guests:
    """Where other hosts connect.

    Attributes:
        address: Of this host, on which it is listened; ``0.0.0.0`` for all.
        port: Of TCP.
        folder: Of the certificates that ``groundstation certificates`` has made.
    """

    address: str
    port: int
    folder: Path

    @property
    def endpoint(self) -> str:
        """As Zenoh writes it."""
        address = f"[{self.address}]" if ":" in self.address else self.address
        return f"tls/{address}:{self.port}"

    def check(self) -> None:
        """Refuse a folder that lacks a file.

        Raises:
            UsageError: It names the file.
        """
        for name in FILES:
            if not (self.folder / name).is_file():
                raise UsageError(
                    f"{self.folder / name} is not there: make it with "
                    f"`groundstation certificates --out {self.folder}`"
                )

    def settings(self) -> dict[str, Any]:
        """Zenoh's settings of the hub, by their keys."""
        authority, certificate, key = (str((self.folder / name).absolute()) for name in FILES)
        return {
            "transport/link/tls": {
                "root_ca_certificate": authority,
                "listen_certificate": certificate,
                "listen_private_key": key,
                "enable_mtls": True,
                "close_link_on_expiration": True,
            },
            "access_control": access_control(),
        }


def access_control() -> dict[str, Any]:
    """What each may do: whoever comes over TCP is on this host, since only loopback is listened on."""
    everything = [
        "put", "delete", "query", "reply",
        "declare_subscriber", "declare_queryable", "declare_liveliness_subscriber", "liveliness_query",
        "liveliness_token",
    ]  # fmt: skip
    rules = [_rule("everything", everything, ("ingress", "egress"), ("**",))]
    subjects: list[dict[str, Any]] = [{"id": "this host", "link_protocols": ["tcp"]}]
    policies = [{"rules": ["everything"], "subjects": ["this host"]}]
    asking = ["declare_subscriber", "query", "declare_liveliness_subscriber", "liveliness_query"]
    rules.append(_rule("ask", asking, ("ingress",), ("**",)))
    rules.append(_rule("receive", ["put", "delete", "reply", "liveliness_token"], ("egress",), ("**",)))
    # a publisher on this side is told of subscribers by their declarations
    rules.append(_rule("be told who subscribes", ["declare_subscriber"], ("egress",), ("**",)))
    for role, keys in MAY_PUBLISH.items():
        subjects.append({"id": role, "cert_common_names": [role], "link_protocols": ["tls"]})
        given = ["ask", "receive", "be told who subscribes"]
        if keys:
            rules.append(_rule(f"publish as {role}", ["put"], ("ingress",), keys))
            given.append(f"publish as {role}")
        policies.append({"rules": given, "subjects": [role]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _rule(name: str, messages: list[str], flows: tuple[str, ...], keys: tuple[str, ...]) -> dict[str, Any]:
    return {
        "id": name,
        "permission": "allow",
        "messages": messages,
        "flows": list(flows),
        "key_exprs": list(keys),
    }
