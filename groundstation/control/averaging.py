"""Mean turn rate between two updates of a controller.

The rate of a state is one sample of the gyro. Picking one of ten aliases the noise of the other nine into the
controller's band; their mean does not. Pose and velocity are the newest: their errors are slow, a mean would
only make them late.
"""

from dataclasses import replace

from groundstation.control.state import ControlState


class RateMean:
    """Collects the states of one mock-up and hands out the newest with the mean rate."""

    def __init__(self) -> None:
        self._newest: ControlState | None = None
        self._sum_rad_s = 0.0
        self._count = 0

    def add(self, state: ControlState) -> None:
        """Take a state as it arrives."""
        self._newest = state
        self._sum_rad_s += state.rate_rad_s
        self._count += 1

    def take(self) -> ControlState | None:
        """The newest state, its rate averaged since the last call; None before the first.

        With nothing new the last one is handed out as it came.
        """
        if self._newest is None or self._count == 0:
            return self._newest
        mean_rad_s = self._sum_rad_s / self._count
        self._sum_rad_s, self._count = 0.0, 0
        return replace(self._newest, rate_rad_s=mean_rad_s)
