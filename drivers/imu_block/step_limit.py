"""A gyro code that jumps further than a mock-up can turn is set aside until a second one agrees."""

GYRO_STEP_COUNTS = 600.0  # D: 146 deg/s between neighbouring frames; self-test is 221 counts


class StepLimit:
    """Judges codes one after another: a spike costs itself alone, a lasting step its first frame.

    Args:
        limit: Largest step that is believed, in the unit of the codes.
    """

    def __init__(self, limit: float) -> None:
        self._limit = limit
        self._believed: float | None = None
        self._set_aside: float | None = None

    def is_step(self, code: float) -> bool:
        """Whether a code is too far from the last one believed, and from one set aside just before."""
        before, self._set_aside = self._set_aside, None
        is_near = self._believed is None or abs(code - self._believed) <= self._limit
        if is_near or (before is not None and abs(code - before) <= self._limit):
            self._believed = code
            return False
        self._set_aside = code
        return True
