"""What is told at the end of a run: the faults of each vehicle, and whom a fault brought down."""

from collections.abc import Iterator

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.envelope import Delivered
from groundstation.bus.record_stream import Recorded
from groundstation.declarations.message import Message
from groundstation.parts.supervision.accounting import account_for
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.supervision.account import Account, Episode

_KINDS: dict[str, type[Message]] = {kind.TOPIC.noun: kind for kind in (Faults, Supervision)}
MOST_SHOWN = 6
"""Faults of a vehicle; the report names the rest."""


class FaultSummary:
    """Takes what supervisors publish, live from the record stream or in lockstep.

    Args:
        vehicles: Names of the vehicles.
        began_ns: When the run began, on the clock of the stamps.
    """

    def __init__(self, vehicles: tuple[str, ...], began_ns: int) -> None:
        self._accounts = {name: Account() for name in vehicles}
        self._began_ns = began_ns

    @property
    def brought_down(self) -> dict[str, str]:
        """Vehicles that a fault landed or stopped, and why."""
        return {
            name: account.brought_down for name, account in self._accounts.items() if account.brought_down
        }

    def take(self, recorded: Recorded) -> None:
        """Account for a message of the record stream; of one that is garbled the monitor reports."""
        kind = _KINDS.get(recorded.noun)
        if kind is None or recorded.owner not in self._accounts:
            return
        try:
            self._account(codec_of(kind).decode(recorded.data))
        except CodecError:
            return

    def take_delivered(self, delivered: Delivered, now_ns: int) -> None:
        """Account for a message that was never encoded."""
        del now_ns
        if delivered.envelope.topic.noun in _KINDS:
            self._account(delivered.payload)

    def lines(self) -> Iterator[str]:
        """For people; nothing where nothing went wrong."""
        for name, account in self._accounts.items():
            for episode in account.episodes[:MOST_SHOWN]:
                yield f"{name}: {_words(episode)}"
            more = len(account.episodes) - MOST_SHOWN
            if more > 0:
                yield f"{name}: and {more} more faults; groundstation report names them"
            if account.brought_down:
                yield f"{name}: LANDED BY A FAULT: {account.brought_down}"

    def _account(self, message: Message) -> None:
        account = self._accounts.get(message.vehicle)
        if account is not None:
            account_for(account, message, (message.stamp_ns - self._began_ns) * 1e-9)


def _words(episode: Episode) -> str:
    span = "to the end" if episode.until_s is None else f"for {episode.until_s - episode.since_s:.1f} s"
    detail = f" ({episode.detail})" if episode.detail else ""
    return f"fault {episode.id} from {episode.since_s:.1f} s {span}{detail}: {episode.response}"
