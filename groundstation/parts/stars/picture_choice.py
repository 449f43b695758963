"""Which refused pictures are worth keeping: the first of a kind at once, then ever fewer."""

NS_PER_S = 1_000_000_000
SOONEST_NS = NS_PER_S
LONGEST_NS = 32 * NS_PER_S


class PictureChoice:
    """Chooses pictures by their stamps alone, so that a replay chooses the same.

    A refusal with another reason than the last one is shown after a second; the same reason again after
    two, four, ... seconds, 32 at most. A fix ends the row. A request is met by the next picture.
    """

    def __init__(self) -> None:
        self._is_asked = False
        self._kind = ""
        self._last_ns = -SOONEST_NS
        self._next_ns = 0
        self._gap_ns = SOONEST_NS

    def ask(self) -> None:
        """The next picture is wanted, whatever becomes of it."""
        self._is_asked = True

    def wants(self, stamp_ns: int, kind: str) -> bool:
        """Whether a picture is kept.

        Args:
            stamp_ns: Of the picture; stamps rise.
            kind: Kind of the refusal, empty for a fix.
        """
        if not kind:
            self._kind, self._gap_ns = "", SOONEST_NS
            asked, self._is_asked = self._is_asked, False
            return asked
        if kind != self._kind:
            self._kind, self._gap_ns = kind, SOONEST_NS
            self._next_ns = min(self._next_ns, self._last_ns + SOONEST_NS)
        if not self._is_asked and stamp_ns < self._next_ns:
            return False
        self._is_asked = False
        self._last_ns = stamp_ns
        self._next_ns = stamp_ns + self._gap_ns
        self._gap_ns = min(2 * self._gap_ns, LONGEST_NS)
        return True
