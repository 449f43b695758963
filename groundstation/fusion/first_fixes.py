"""Fixes that came before there is a pose: one alone may be wrong, so two must agree."""

from __future__ import annotations

from collections.abc import Callable

from groundstation.fusion.estimator import Fix

CANDIDATE = "waits for a second fix"
CANDIDATE_AGE_S = 5.0
"""A first fix is compared with those up to this long after it."""
ALONE = "no second fix agreed"


class FirstFixes:
    """The fixes that wait for a second one."""

    __slots__ = ("_waiting",)

    def __init__(self) -> None:
        self._waiting: list[Fix] = []

    def consider(
        self, fix: Fix, agree: Callable[[Fix, Fix], bool]
    ) -> tuple[Fix | None, list[tuple[Fix, str]]]:
        """Compare a fix with those that wait, the newest first; without agreement it waits, too.

        Returns:
            The fix that it agrees with, or None; and those that wait no longer, each with the reason.
        """
        first = next((old for old in reversed(self._waiting) if agree(old, fix)), None)
        if first is not None:
            settled = [(old, "starts the estimate" if old is first else ALONE) for old in self._waiting]
            self._waiting.clear()
            return first, settled
        limit_ns = fix.t_exposure_ns - int(CANDIDATE_AGE_S * 1e9)
        settled = [(old, ALONE) for old in self._waiting if old.t_exposure_ns < limit_ns]
        self._waiting = [old for old in self._waiting if old.t_exposure_ns >= limit_ns]
        self._waiting.append(fix)
        return None, settled
