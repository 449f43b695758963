"""The launcher's own running time: a clock that stands still while the launcher does.

A launcher that was stopped (Ctrl-Z, a laptop's lid, a debugger) finds everybody silent on waking, and means
its own silence. So it judges others only by time during which it looked.
"""

LONGEST_STEP_S = 0.5
"""The loop comes by twenty times a second; what is missing beyond this it did not run."""


class RunningTime:
    """Sums up the steps of a loop, each at most ``LONGEST_STEP_S``.

    Attributes:
        now_s: Running time of the newest step.
    """

    def __init__(self) -> None:
        self.now_s = 0.0
        self._newest_s: float | None = None

    def step(self, clock_s: float) -> float:
        """Note that the loop comes by; return the running time.

        Args:
            clock_s: Monotonic clock.
        """
        if self._newest_s is not None:
            self.now_s += min(max(clock_s - self._newest_s, 0.0), LONGEST_STEP_S)
        self._newest_s = clock_s
        return self.now_s
