"""Whether valve commands take effect later than usual, by the counter that a valve node reports. Pure.

A command that reaches the node late begins late and ends late, and pushes when none was meant. On a machine
or a line that is choked that happens now and then, and is nothing of a valve's.
"""

from collections import deque

RECENT = 100
"""Statuses, two seconds of them, that show what is usual."""
USUAL_SHARE = 0.9
LATE_NS = 10_000_000
"""Beyond the usual; commands that are less late explain no false alarm."""
COUNTER_MODULUS = 16


class CommandLag:
    """Compares the counters of commands with those that the node has received."""

    def __init__(self) -> None:
        self._sent_ns = [0] * COUNTER_MODULUS
        self._newest = 0
        self._ages_ns: deque[int] = deque(maxlen=RECENT)

    def command(self, stamp_ns: int, counter: int) -> None:
        """Take a command as it is sent."""
        self._newest = counter % COUNTER_MODULUS
        self._sent_ns[self._newest] = stamp_ns

    def behind(self, counter: int) -> int:
        """How many commands the node has not received that reports a counter."""
        return (self._newest - counter) % COUNTER_MODULUS

    def is_late(self, stamp_ns: int, counter: int) -> bool:
        """Take a status of the node; whether a command has been on its way for longer than usual."""
        behind = self.behind(counter)
        first = self._sent_ns[(counter + 1) % COUNTER_MODULUS]
        age_ns = max(0, stamp_ns - first) if behind else 0
        ages = self._ages_ns
        usual_ns = sorted(ages)[int(USUAL_SHARE * len(ages))] if len(ages) == RECENT else age_ns
        ages.append(age_ns)
        return age_ns > usual_ns + LATE_NS
