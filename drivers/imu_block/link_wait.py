"""How long a USB adapter holds back the last byte of every packet, which no arrival shows.

An adapter sends what it has when a packet is full or when a timer expires. FTDI's timer runs from the packet
before (application note AN232B-04), other chips' from the first byte that waits; of a link in between nothing
is known. The last byte of a full packet has not waited. Of others only this is certain: it did not wait
longer than until the next byte left the block, which would have come with it; nor longer than the timer less
the time from the packet's first byte to its last.
"""

import math

FTDI_PACKET_BYTES = 62
USUAL_TIMER_NS = 16e6
"""FTDI's default, which a driver that is installed anew brings back."""
_TOLERANCE_NS = 1e6
"""A packet that lasted longer than the timer by so much shows that the timer is another."""


class LinkWait:
    """What is known of the timer of a link.

    Args:
        timer_ns: As somebody says.

    Attributes:
        timer_ns: As somebody says, or as it was measured.
    """

    def __init__(self, timer_ns: float) -> None:
        self.timer_ns = timer_ns
        self._is_measured = False
        self._asked: tuple[float | None, float | None] | None = None
        self._answer = (0.0, 0.0)

    @property
    def longest_timer_ns(self) -> float:
        """What the timer may be: as measured, else not only what somebody says but what adapters have."""
        return self.timer_ns if self._is_measured else max(self.timer_ns, USUAL_TIMER_NS)

    def measured(self, timer_ns: float) -> None:
        """Take the timer from the adapter itself."""
        if not self._is_measured or timer_ns != self.timer_ns:
            self.timer_ns, self._is_measured, self._asked = timer_ns, True, None

    def wait(self, span_ns: float | None, pause_ns: float | None) -> tuple[float, float]:
        """Return the likely wait of the last byte of the packets that waited least, and its sigma, ns.

        The likely wait is that of a timer which starts with a packet's first byte. Where such a timer would
        have waited for the next byte, too, it is shorter than somebody says, or runs from the packet before:
        packets that waited least have hardly waited then. What somebody says of a timer that was not measured
        is likely, but no limit.

        Args:
            span_ns: from the departure of their first byte to that of their last; None if unknown.
            pause_ns: from the departure of their last byte to that of the next; None if unknown.
        """
        if (
            span_ns,
            pause_ns,
        ) != self._asked:  # which change once a second, and are asked about with each frame
            self._asked = span_ns, pause_ns
            self._answer = self._wait(span_ns, pause_ns)
        return self._answer

    def _wait(self, span_ns: float | None, pause_ns: float | None) -> tuple[float, float]:
        left_ns = self.timer_ns - (span_ns or 0.0)
        longest_ns = math.inf if pause_ns is None else pause_ns
        is_possible = left_ns > -_TOLERANCE_NS
        likely_ns = max(0.0, left_ns)
        if self._is_measured and is_possible:
            longest_ns = min(longest_ns, likely_ns)
        elif longest_ns == math.inf:
            longest_ns = likely_ns
        if likely_ns > longest_ns + _TOLERANCE_NS:
            likely_ns = 0.0
        likely_ns = min(likely_ns, longest_ns) if is_possible else longest_ns / 2
        if not longest_ns:
            return 0.0, 0.0
        # rms distance from the likely wait of what is equally possible between nothing and the longest
        variance_ns2 = (likely_ns**3 + (longest_ns - likely_ns) ** 3) / (3 * longest_ns)
        return likely_ns, math.sqrt(variance_ns2)
