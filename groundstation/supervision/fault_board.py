"""Which faults a vehicle has, since when, and the strongest response that is due."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from groundstation.supervision.faults import CLEAR_S, FAULTS, Clears, Fault, Response

_CLEAR_NS = round(CLEAR_S * 1e9)


@dataclass(slots=True)
class Standing:
    """A fault that a vehicle has.

    Attributes:
        fault: Its row.
        detail: What was found, with numbers.
        since_ns: When it was found.
        seen_ns: When it was seen last.
        is_there: Seen the last time anybody looked; a latched one may be gone and still stand.
    """

    fault: Fault
    detail: str
    since_ns: int
    seen_ns: int
    is_there: bool = True

    def response(self, now_ns: int) -> Response:
        """What is due now; of one that is gone and only latched, nothing more."""
        if not self.is_there:
            return Response.NOTE
        return self.fault.response((now_ns - self.since_ns) * 1e-9)


class FaultBoard:
    """Faults of one vehicle, latched until they clear.

    Args:
        faults: The table.
    """

    def __init__(self, faults: Mapping[str, Fault] = FAULTS) -> None:
        self._faults = faults
        self._standing: dict[str, Standing] = {}

    def __iter__(self) -> Iterator[Standing]:
        """Those that stand, oldest first."""
        return iter(self._standing.values())

    def __contains__(self, fault_id: str) -> bool:
        return fault_id in self._standing

    def look(self, now_ns: int, found: Mapping[str, str]) -> bool:
        """Take what is found wrong at this moment, by id with details; True if a fault began or ended.

        Raises:
            KeyError: The table has no such fault.
        """
        changed = False
        for fault_id, detail in found.items():
            standing = self._standing.get(fault_id)
            if standing is None:
                fault = self._faults[fault_id]
                self._standing[fault_id] = Standing(fault, detail, now_ns, now_ns)
                changed = True
                continue
            if not standing.is_there:
                standing.is_there, standing.since_ns = True, now_ns
                standing.detail = detail
                changed = True
            standing.seen_ns = now_ns
        for fault_id, standing in tuple(self._standing.items()):
            if fault_id in found or now_ns - standing.seen_ns < _CLEAR_NS:
                continue
            if standing.fault.clears is Clears.ITSELF:
                del self._standing[fault_id]
                changed = True
            elif standing.is_there:
                standing.is_there = False
                changed = True
        return changed

    def clear(self) -> bool:
        """A person clears what is gone; True if anything was."""
        gone = [fault_id for fault_id, standing in self._standing.items() if not standing.is_there]
        for fault_id in gone:
            del self._standing[fault_id]
        return bool(gone)

    def worst(self, now_ns: int) -> Standing | None:
        """The fault whose response is strongest now, the oldest of equals; None where nothing is due."""
        worst, due = None, Response.NOTE
        for standing in self._standing.values():
            response = standing.response(now_ns)
            if response > due:
                worst, due = standing, response
        return worst
