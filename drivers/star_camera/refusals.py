"""Pictures that were not passed on, by the reason."""

from collections import Counter
from collections.abc import Mapping

_KINDS = 12
_OTHERS = "other reasons"


class PictureRefused(ValueError):  # noqa: N818 - it says what happened
    """A picture that cannot be used.

    Args:
        kind: What it is counted under: few different ones.
        detail: Figures of this one.
    """

    def __init__(self, kind: str, detail: str = "") -> None:
        super().__init__(f"{kind}: {detail}" if detail else kind)
        self.kind = kind


class Refusals:
    """Counts, by kind; so many kinds at most, whatever a sender invents."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()

    def count(self, kind: str) -> None:
        """One more of a kind."""
        self._counts[kind if kind in self._counts or len(self._counts) < _KINDS else _OTHERS] += 1

    @property
    def counts(self) -> Mapping[str, int]:
        """So far, the most frequent first."""
        return dict(self._counts.most_common())

    @property
    def total(self) -> int:
        """All kinds together."""
        return self._counts.total()

    def in_words(self) -> str:
        """``3 x a JPEG is damaged, 1 x ...``; empty without any."""
        return ", ".join(f"{count} x {kind}" for kind, count in self.counts.items())
