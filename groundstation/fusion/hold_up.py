"""How much later than usual IMU samples arrive: what a stamp that was taken at an arrival can be trusted for.

A busy machine, a paused process or a choked line holds up all that arrives in a process, not the samples
alone. The block's clock places samples all the same; a pose that was stamped when it arrived has no clock,
and is of an earlier moment than its stamp states.
"""

from collections import deque

RECENT_NS = 100_000_000
"""A hold-up counts for what arrives up to so long after it."""
CREEP = 2e-4
"""The usual lateness rises by so much per second where samples never come as early as before."""


class HoldUp:
    """Follows the lateness of samples over its lower envelope.

    Args:
        spread_s: Of the lateness on a quiet machine: the timer of the serial adapter.
    """

    def __init__(self, spread_s: float) -> None:
        self._spread_ns = round(spread_s * 1e9)
        self._usual_ns = 0.0
        self._period_ns = 0
        self._arrived_ns, self._stamp_ns = 0, 0
        self._recent: deque[tuple[int, float]] = deque()

    def sample(self, arrived_ns: int, stamp_ns: int) -> None:
        """Take a sample's arrival, and its stamp by the block's clock."""
        late_ns = float(arrived_ns - stamp_ns)
        if self._stamp_ns:
            crept_ns = self._usual_ns + CREEP * (arrived_ns - self._arrived_ns)
            self._usual_ns = min(late_ns, crept_ns)
            self._period_ns = max(0, stamp_ns - self._stamp_ns)
        else:
            self._usual_ns = late_ns
        self._arrived_ns, self._stamp_ns = arrived_ns, stamp_ns
        recent = self._recent
        while recent and arrived_ns - recent[0][0] > RECENT_NS:
            recent.popleft()
        excess_ns = late_ns - self._usual_ns
        if excess_ns > self._spread_ns:  # what is less counts for nothing
            recent.append((arrived_ns, excess_ns))

    def excess_s(self, now_ns: int) -> float:
        """How much later than usual something that arrives now may be, s; 0 where nothing is held up.

        A sample that should be here by now and is not counts as one that is late; with a block that is silent
        the doubt grows, since nothing tells any more.
        """
        if not self._stamp_ns:
            return 0.0
        due_ns = self._stamp_ns + self._period_ns + self._usual_ns
        excess_ns = max(now_ns - due_ns, 0.0)
        for arrived_ns, late_ns in self._recent:
            if late_ns > excess_ns and now_ns - arrived_ns <= RECENT_NS:
                excess_ns = late_ns
        return excess_ns * 1e-9 if excess_ns > self._spread_ns else 0.0
