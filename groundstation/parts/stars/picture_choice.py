"""Which refused pictures are worth keeping: the first of a kind at once, then ever fewer."""

NS_PER_S = 1_000_000_000
SOONEST_NS = NS_PER_S
LONGEST_NS = 32 * NS_PER_S


class PictureChoice:
    """Chooses pictures by their stamps alone, so that a replay chooses the same.

    The first refusal for a reason is kept at once, or a second after the last picture that was kept; further
    ones for the same reason follow after gaps of 1, 2, 4, ... 32 s. A fix starts this anew. A request is
    met by the next picture, whatever became of it.
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
