"""Messages of supervision as entries of an account."""

from groundstation.declarations.message import Message
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.supervision.account import Account


def account_for(account: Account, message: Message, t_s: float) -> None:
    """Take faults and rulings into an account; other messages leave it as it is."""
    match message:
        case Faults():
            there = tuple(gone_ns == 0.0 for gone_ns in message.gone_ns)
            account.take_faults(t_s, message.ids, message.details, message.responses, there)
        case Supervision():
            account.take_ruling(
                t_s, message.mode, message.author, message.cause, is_stop_latched=message.stop_latched
            )
