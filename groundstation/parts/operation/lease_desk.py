"""Lease desk: grants control of the rig to one operator at a time, hands it over, lets it expire."""

from collections.abc import Iterator

from groundstation.declarations.lease import LONGEST_S, Lease, held_words
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Action, Argument, ArgumentError, Request, answer, table_of
from groundstation.parts.operation.lease_memory import lease_of
from groundstation.parts.operation.messages import KeptLease

USUAL_S = 600.0

ACTIONS = table_of(
    Action(
        "take_control",
        "lease_desk",
        "hold control of the rig: others can then only stop, land, disarm, float_off and brake",
        (
            Argument("for_s", "how long", float, 1.0, LONGEST_S, default=USUAL_S),
            Argument("force", "reason to take what has expired and was not given back", str, default=""),
        ),
        is_of_rig=True,
    ),
    Action(
        "give_control",
        "lease_desk",
        "give control of the rig back, or to somebody",
        (Argument("to", "name; empty for nobody", str, default=""),),
        is_of_rig=True,
    ),
)


class LeaseDesk(Node):
    """Publishes the lease that was kept on disk, and whenever it changes.

    Args:
        vehicles: Requests may name any of them, or none: the lease is the rig's.
    """

    inputs = (Request, KeptLease)
    outputs = (Lease, Ack)

    def __init__(self, vehicles: tuple[str, ...]) -> None:
        super().__init__("")
        self._vehicles = vehicles
        self._lease = Lease(0, "", "", 0, "")

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        del payload
        return (*self._vehicles, "")

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        if isinstance(message, KeptLease):
            self._lease = lease_of(message)
            yield self._lease
        if not isinstance(message, Request) or message.action not in ACTIONS:
            return
        before = self._lease
        reason = self._carry_out(message, now_ns)
        if self._lease is not before:
            yield self._lease
        yield answer(message, now_ns, reason)

    def _carry_out(self, request: Request, now_ns: int) -> str:
        """Do what was asked; the reason if it cannot be done."""
        try:
            given = ACTIONS[request.action].read(request)
        except ArgumentError as error:
            return str(error)
        if not request.author:
            return f"{request.action} needs a name"
        if request.action == "give_control":
            return self._give(request.author, str(given["to"]).strip(), now_ns)
        return self._take(request.author, float(given["for_s"]), str(given["force"]).strip(), now_ns)

    def _take(self, author: str, for_s: float, force: str, now_ns: int) -> str:
        holder = self._lease.holder
        is_of_another = holder not in ("", author)
        if is_of_another and now_ns < self._lease.expires_ns:
            hint = "it cannot be forced before that" if force else f"ask {holder} to give_control"
            return f"{held_words(self._lease, now_ns)}: {hint}"
        if is_of_another and not force:
            return f"{holder} has not given control back: take it with force=REASON"
        self._grant(now_ns, author, now_ns + round(for_s * 1e9), force if is_of_another else "")
        return ""

    def _give(self, author: str, to: str, now_ns: int) -> str:
        if self._lease.holder != author:
            return f"control is held by {self._lease.holder or 'nobody'}"
        if to and now_ns >= self._lease.expires_ns:
            return "your lease has expired: take_control first"
        self._grant(now_ns, to, self._lease.expires_ns if to else 0)
        return ""

    def _grant(self, now_ns: int, holder: str, expires_ns: int, reason: str = "") -> Lease:
        self._lease = Lease(now_ns, "", holder, expires_ns, reason)
        return self._lease
