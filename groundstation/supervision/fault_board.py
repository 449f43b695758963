"""Which faults a vehicle has, since when, and the strongest response that is due."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from groundstation.supervision.faults import CLEAR_S, FAULTS, Clears, Fault, Response

RECALLED = "it was there before a restart"
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

    @property
    def response(self) -> Response:
        """What is due for as long as it was seen; of one that is gone and only latched, nothing more."""
        if not self.is_there:
            return Response.NOTE
        return self.fault.response((self.seen_ns - self.since_ns) * 1e-9)


class FaultBoard:
    """Faults of one vehicle, latched until they clear.

    Args:
        faults: The table.
    """

    def __init__(self, faults: Mapping[str, Fault] = FAULTS) -> None:
        self._faults = faults
        self._standing: dict[str, Standing] = {}
        self._shown: list[tuple[str, bool, Response]] = []
        self._suspected_ns: dict[str, int] = {}  # since when what is not confirmed yet is seen

    def __iter__(self) -> Iterator[Standing]:
        """Those that stand, oldest first."""
        return iter(self._standing.values())

    def __contains__(self, fault_id: str) -> bool:
        return fault_id in self._standing

    def look(self, now_ns: int, found: Mapping[str, str]) -> bool:
        """Take what is found wrong at this moment, by id with details; True if anything has changed.

        Raises:
            KeyError: The table has no such fault.
        """
        self._suspected_ns = {fault_id: self._suspected_ns.get(fault_id, now_ns) for fault_id in found}
        for fault_id, detail in found.items():
            fault = self._faults[fault_id]
            if now_ns - self._suspected_ns[fault_id] >= fault.confirm_s * 1e9:
                self._see(fault, detail, now_ns)
        for fault_id, standing in tuple(self._standing.items()):
            if standing.seen_ns == now_ns or now_ns - standing.seen_ns < _CLEAR_NS:
                continue
            if standing.fault.clears is Clears.ITSELF:
                del self._standing[fault_id]
            else:
                standing.is_there = False
        shown = [(row.fault.id, row.is_there, row.response) for row in self]
        has_changed, self._shown = shown != self._shown, shown
        return has_changed

    def _see(self, fault: Fault, detail: str, now_ns: int) -> None:
        standing = self._standing.get(fault.id)
        if standing is None or not standing.is_there:  # one that comes again begins again
            self._standing[fault.id] = Standing(fault, detail, now_ns, now_ns)
        else:
            standing.seen_ns = now_ns

    @property
    def latched(self) -> tuple[str, ...]:
        """Those that a person has to clear."""
        return tuple(row.fault.id for row in self if row.fault.clears is Clears.PERSON)

    def recall(self, fault_ids: Iterable[str], now_ns: int) -> None:
        """Take up what was latched before a restart; what is no row any more is forgotten."""
        for fault_id in fault_ids:
            fault = self._faults.get(fault_id)
            if fault is not None:
                self._standing[fault_id] = Standing(fault, RECALLED, now_ns, now_ns, is_there=False)

    def clear(self) -> bool:
        """A person clears what is gone; True if anything was."""
        gone = [fault_id for fault_id, standing in self._standing.items() if not standing.is_there]
        for fault_id in gone:
            del self._standing[fault_id]
        return bool(gone)

    def worst(self) -> Standing | None:
        """The fault whose response is strongest now, the oldest of equals; None where nothing is due."""
        worst, due = None, Response.NOTE
        for standing in self._standing.values():
            if standing.response > due:
                worst, due = standing, standing.response
        return worst
