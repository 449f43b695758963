"""The fixes used lately and the filter's state after each: what a fix from a slower source is put between.

Two sources see the same vehicle with different delays: a fix that took 0.6 s comes after fixes of later
exposures have been used. The filter then goes back to the last one before it, takes it, and takes the
later ones again. With one source nothing is kept but the newest.
"""

from __future__ import annotations

from dataclasses import dataclass

from groundstation.fusion.checkpoint import Checkpoint
from groundstation.fusion.creep_watch import CreepWatch
from groundstation.fusion.estimator import Fix

MEMORY_S = 2.0
"""A fix that comes later than this after one that was used is too old to matter."""


@dataclass(frozen=True, slots=True, eq=False)
class Past:
    """A used fix and the filter after it."""

    fix: Fix
    checkpoint: Checkpoint
    creep: CreepWatch

    @property
    def t_s(self) -> float:
        """The fix's exposure."""
        return self.checkpoint.t_s


class PastFixes:
    """Used fixes in the order of their exposures."""

    __slots__ = ("_pasts", "_sources")

    def __init__(self) -> None:
        self._pasts: list[Past] = []
        self._sources: set[str] = set()

    def meet(self, source: str) -> None:
        """Note that there is such a source."""
        self._sources.add(source)

    def note(self, past: Past) -> float:
        """Keep a fix that was used; return the oldest moment that may still be asked for."""
        self._pasts.append(past)
        if len(self._sources) < 2:
            del self._pasts[:-1]
        while len(self._pasts) > 1 and self._pasts[1].t_s < past.t_s - MEMORY_S:
            del self._pasts[0]
        return self._pasts[0].t_s

    def before_and_after(self, fix: Fix, t_s: float) -> tuple[list[Past], list[Past]] | None:
        """Split at a fix's exposure; None if it is too old, or its own source has been used later."""
        if any(past.fix.source == fix.source and past.t_s >= t_s for past in self._pasts):
            return None
        before = [past for past in self._pasts if past.t_s <= t_s]
        return (before, self._pasts[len(before) :]) if before else None

    def replace(self, pasts: list[Past]) -> None:
        """Go on from these."""
        self._pasts = list(pasts)

    def forget(self) -> None:
        """Begin anew: what was used before a restart is no ground to build on."""
        self._pasts = []
