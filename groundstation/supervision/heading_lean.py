"""Headings of fixes less the turn by the gyro, and the case that they lean to one side."""

from dataclasses import dataclass, field

FIX_CAP = 4.0
"""The most that one fix adds to a case: it may be wrong."""


@dataclass(slots=True)
class Lean:
    """The case that the gyro's zero jumped by a stated step, to one side."""

    evidence: float = 0.0
    offset_rad: float = 0.0  # by how much the expected heading would be off by now

    def add(self, gap_rad: float, moved_rad: float, variance: float, gain: float) -> None:
        """Take a fix: its innovation and variance, and what the step turns since the fix before."""
        offset = self.offset_rad + moved_rad
        added = min(FIX_CAP, (gap_rad - 0.5 * offset) * offset / variance)
        if self.evidence + added <= 0.0:
            self.evidence = self.offset_rad = 0.0
            return
        self.evidence += added
        self.offset_rad = (1.0 - gain) * offset


@dataclass(slots=True)
class Heading:
    """What fixes say beyond the turn by the gyro: constant, but for noise."""

    stamp_ns: int
    turned_rad: float
    offset_rad: float
    variance: float
    wrong_in_a_row: int = 0
    leans: tuple[Lean, Lean] = field(default_factory=lambda: (Lean(), Lean()))
