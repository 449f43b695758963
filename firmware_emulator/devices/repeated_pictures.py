"""Pictures that a camera sends again: the frozen one, and the last few in a loop."""

from collections import deque
from typing import Generic, TypeVar

from firmware_emulator.failures import Failures

_KEPT = 100  # the most that `repeating_camera` repeats

PictureT = TypeVar("PictureT")


class RepeatedPictures(Generic[PictureT]):
    """What a camera shows in place of what it saw.

    Args:
        failures: `frozen_camera`, `repeating_camera`.
    """

    def __init__(self, failures: Failures) -> None:
        self._failures = failures
        self._seen: deque[PictureT] = deque(maxlen=_KEPT)
        self._frozen: PictureT | None = None
        self._loop: deque[PictureT] = deque()

    def shown(self, seen: PictureT, age_ns: int) -> PictureT:
        """What is sent in place of the picture seen now, `age_ns` after power-up: itself, or an older one.

        The first picture of a freeze is a new one; a camera that repeats begins with the oldest of its last.
        """
        frozen = self._failures.active("frozen_camera", age_ns)
        repeating = self._failures.active("repeating_camera", age_ns)
        if frozen is None:
            self._frozen = None
        elif self._frozen is None:
            self._frozen = seen
        if repeating is None:
            self._loop.clear()
            self._seen.append(seen)
        elif not self._loop:
            count = int(repeating.parameters["pictures"])
            self._loop.extend(list(self._seen)[-count:] or [seen])
        if self._frozen is not None:
            return self._frozen
        if not self._loop:
            return seen
        self._loop.rotate(-1)
        return self._loop[-1]
