"""Numbers of the report: faults, closures, time without a state."""

from dataclasses import asdict
from typing import Any

from groundstation.declarations.message import Message
from groundstation.declarations.view import Figure
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveCommand
from groundstation.supervision.account import Account


class SupervisionFigure(Figure):
    """Account of one vehicle."""

    inputs = (Faults, Supervision, VehicleState, ValveCommand)

    def __init__(self) -> None:
        self._account = Account()

    def take(self, message: Message, t_s: float) -> None:
        match message:
            case Faults():
                self._account.take_faults(
                    t_s,
                    message.ids,
                    message.details,
                    message.responses,
                    tuple(gone_ns == 0.0 for gone_ns in message.gone_ns),
                )
            case Supervision():
                self._account.take_ruling(
                    t_s, message.mode, message.author, message.cause, is_stop_latched=message.stop_latched
                )
            case VehicleState():
                self._account.take_state(t_s, message.status)
            case ValveCommand():
                self._account.take_gate(is_open=message.gate == "open")

    def values(self) -> dict[str, Any]:
        account = self._account
        return {
            "faults": [asdict(episode) for episode in account.episodes],
            "closures": account.closures,
            "time_without_state_s": account.time_without_state_s,
            "landed_by_fault": account.brought_down or None,
        }
