"""The control lease: one operator holds control, others watch; anyone may stop.

Nodes that answer requests ask a ``LeaseCheck`` first. The time that is left is in words of a duration: nodes
know no wall clock.
"""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import I64, PACKAGE, Message, Text
from groundstation.declarations.request import Request
from groundstation.declarations.topic import Rank, Scope, Topic

LONGEST_S = 3600.0
"""A lease ends after so long at the latest, unless it is taken again."""
FREE_FOR_ALL = frozenset({"stop", "land", "disarm", "float_off", "brake"})
"""Actions that take motion away: whoever holds control, anyone may ask for them."""


@dataclass(frozen=True, slots=True, eq=False)
class Lease(Message):
    """Who holds control of the rig; latched.

    Attributes:
        holder: Name; empty where nobody does.
        expires_ns: On the host's monotonic clock.
        reason: Why it was taken from somebody who had not given it back; empty otherwise.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Lease"
    TOPIC: ClassVar = Topic("lease", rank=Rank.REQUEST, scope=Scope.RIG, latched=True)
    holder: Text
    expires_ns: I64
    reason: Text


class LeaseCheck:
    """Knows the newest lease and objects to requests of others."""

    def __init__(self) -> None:
        self._lease: Lease | None = None

    def take(self, lease: Lease) -> None:
        """The newest lease."""
        self._lease = lease

    def objection(self, request: Request, now_ns: int) -> str:
        """Why somebody may not ask for this now; empty if he may."""
        lease = self._lease
        if lease is None or not lease.holder or now_ns >= lease.expires_ns:
            return ""
        if request.author == lease.holder or request.action in FREE_FOR_ALL:
            return ""
        return f"{held_words(lease, now_ns)}; ask for it with take_control"

    def objection_to_commands(self, author: str, now_ns: int) -> str:
        """Why a program may not command a vehicle now; empty if it may: it must hold the lease."""
        lease = self._lease
        if lease is None or not lease.holder:
            return "nobody holds control: ask for it with take_control"
        if author != lease.holder:
            return (
                f"{held_words(lease, now_ns)}; ask for it with take_control"
                if now_ns < lease.expires_ns
                else f"{lease.holder} has not given control back: take it with take_control and force"
            )
        return "" if now_ns < lease.expires_ns else "its lease has expired: ask for it with take_control"


def held_words(lease: Lease, now_ns: int) -> str:
    """Who holds control, and for how long still, as h:mm:ss."""
    minutes, seconds = divmod(max(0, -((now_ns - lease.expires_ns) // 1_000_000_000)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"control is held by {lease.holder} for another {hours}:{minutes:02d}:{seconds:02d}"
