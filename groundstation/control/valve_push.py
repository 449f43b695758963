"""What the valves did to the mock-up over any span of the near past, by the commands they were given."""

from collections import deque
from collections.abc import Sequence

from groundstation.control.state import NO_WRENCH, BodyWrench
from groundstation.control.vehicle import VehicleModel

KEPT_NS = 1_000_000_000
_MS = 1_000_000


class ValvePush:
    """Lays commanded pulses out in time: a new pulse id closes every valve and opens those with an on-time.

    Args:
        model: Where the valves push.
        open_delay_s: From a command to thrust.
        close_delay_s: From the end of an on-time to none.
        kept_ns: How long pulses that ended are remembered.
    """

    def __init__(
        self, model: VehicleModel, open_delay_s: float, close_delay_s: float, kept_ns: int = KEPT_NS
    ) -> None:
        self._columns = [tuple(column) for column in model.effectiveness().T.tolist()]
        self._kept_ns = kept_ns
        self._open_ns, self._close_ns = round(open_delay_s * 1e9), round(close_delay_s * 1e9)
        self._pulse_id: int | None = None
        self._pulses: deque[tuple[int, list[int]]] = deque()  # valve, [start, end) of its thrust

    def command(self, now_ns: int, pulse_id: int, on_time_ms: Sequence[int]) -> None:
        """Take a command at the moment it is sent; one with the pulse id of the last changes nothing."""
        if pulse_id == self._pulse_id:
            return
        self._pulse_id = pulse_id
        for _, span in self._pulses:
            span[1] = min(span[1], now_ns + self._close_ns)
        for valve, on_ms in enumerate(on_time_ms):
            if on_ms:
                span = [now_ns + self._open_ns, now_ns + on_ms * _MS + self._close_ns]
                if self._is_open(valve, now_ns):
                    span[0] = now_ns + self._close_ns  # it never closed in between
                self._pulses.append((valve, span))
        while self._pulses and self._pulses[0][1][1] < now_ns - self._kept_ns:
            self._pulses.popleft()

    def mean(self, start_ns: int, stop_ns: int) -> BodyWrench:
        """Mean wrench on the body over a span, as commanded.

        Raises:
            ValueError: The span is empty.
        """
        if stop_ns <= start_ns:
            raise ValueError(f"a span must have a length, found {stop_ns - start_ns} ns")
        if not self._pulses:
            return NO_WRENCH
        fx = fy = torque = 0.0
        for valve, share in self.open_shares(start_ns, stop_ns):
            x, y, turn = self._columns[valve]
            fx, fy, torque = fx + share * x, fy + share * y, torque + share * turn
        return BodyWrench((fx, fy), torque)

    def open_shares(self, start_ns: int, stop_ns: int) -> list[tuple[int, float]]:
        """Pieces of thrust in a span that is not empty, as commanded: valve, and share of the span (0 to 1).

        A valve whose thrust ended and began again within the span has two.
        """
        return [
            (valve, (min(end, stop_ns) - max(begin, start_ns)) / (stop_ns - start_ns))
            for valve, (begin, end) in self._pulses
            if end > start_ns and begin < stop_ns and end > begin
        ]

    def _is_open(self, valve: int, now_ns: int) -> bool:
        return any(each == valve and begin <= now_ns < end for each, (begin, end) in self._pulses)
