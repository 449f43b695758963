"""Numbers of the report: faults, closures, time without a state."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, ClassVar

import numpy as np

from groundstation.declarations.message import Message
from groundstation.declarations.view import Array, Figure, Wanted
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.supervision.accounting import account_for
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveCommand
from groundstation.supervision.account import LONGEST_GAP_S, Account


class SupervisionFigure(Figure):
    """Account of one vehicle."""

    inputs = (Faults, Supervision)
    columns: ClassVar[Wanted] = {VehicleState: ("status",), ValveCommand: ("gate",)}

    def __init__(self) -> None:
        self._reported: list[tuple[float, Message]] = []
        self._flying_s: list[float] = []
        self._gates: list[bool] = []

    def take(self, message: Message, t_s: float) -> None:
        self._reported.append((t_s, message))

    def take_columns(self, kind: type[Message], t_s: Array, fields: Mapping[str, Array]) -> None:
        if kind is VehicleState:
            self._flying_s = first_and_last(t_s[fields["status"] == b"flying"]).tolist()
        else:
            self._gates = (fields["gate"] == b"open").tolist()

    def values(self) -> dict[str, Any]:
        account = Account()
        states = [(t_s, None) for t_s in self._flying_s]
        for t_s, message in sorted([*self._reported, *states], key=lambda row: row[0]):
            if message is None:
                account.take_state(t_s, "flying")
            else:
                account_for(account, message, t_s)
        for is_open in self._gates:
            account.take_gate(is_open=is_open)
        return {
            "faults": [asdict(episode) for episode in account.episodes],
            "closures": account.closures,
            "time_without_state_s": account.time_without_state_s,
            "landed_by_fault": account.brought_down or None,
        }


def first_and_last(t_s: Array) -> Array:
    """The first and last moment of each half of ``LONGEST_GAP_S``: the gaps that count are those of all."""
    if not len(t_s):
        return t_s
    slots = np.floor(2.0 * t_s / LONGEST_GAP_S)
    changes = np.flatnonzero(np.diff(slots))
    chosen = np.unique([0, *changes, *(changes + 1), len(t_s) - 1])
    found: Array = t_s[chosen]
    return found
