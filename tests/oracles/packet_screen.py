"""Wild packets: one that jumps away and back is not motion."""

from __future__ import annotations

from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.reckoner import largest_steps

TURNS_FASTER_AFTER = 10
"""Packets that may be lost before the limit of the rate grows with their number."""


class PacketScreen:
    """Holds back a packet that differs too much from the last good one, unless the next agrees with it.

    A valve or a push lasts several packets and is believed at the second; a flipped bit or a loose plug does
    not. The limits are the rig's: largest force and torque over mass and inertia, plus noise.
    """

    __slots__ = ("_full_acc", "_full_rate", "_last", "_suspect", "max_acc_step", "max_rate_step")

    def __init__(self, noise: NoiseModel) -> None:
        self._full_rate = noise.full_scale_rad_s
        self._full_acc = noise.full_scale_m_s2
        self.max_rate_step, self.max_acc_step = largest_steps(noise)
        self._last: tuple[float, float, float] | None = None
        self._suspect: tuple[float, float, float] | None = None

    def forget(self) -> None:
        """Believe the next packet whatever it is."""
        self._last = self._suspect = None

    def is_wild(self, rate_rad_s: float, ax: float, ay: float, packets: float = 1.0) -> bool:
        """Return whether the packet shall not be integrated; NaN and infinity are wild.

        Args:
            rate_rad_s: read.
            ax: read.
            ay: read.
            packets: since the one before, lost ones counted: after a hole a vehicle may turn faster.
        """
        last = self._last
        if last is None:
            if self._is_beyond_scale(rate_rad_s, ax, ay):
                return True
            self._last = (rate_rad_s, ax, ay)
            return False
        rate, force = self.max_rate_step, self.max_acc_step
        wider = rate * max(1.0, packets / TURNS_FASTER_AFTER)
        if (
            -wider <= rate_rad_s - last[0] <= wider
            and -force <= ax - last[1] <= force
            and -force <= ay - last[2] <= force
        ):
            self._last = (rate_rad_s, ax, ay)
            self._suspect = None
            return False
        suspect = self._suspect
        if self._is_beyond_scale(rate_rad_s, ax, ay):
            return True
        if (
            suspect is not None
            and -rate <= rate_rad_s - suspect[0] <= rate
            and -force <= ax - suspect[1] <= force
            and -force <= ay - suspect[2] <= force
        ):
            self._last = (rate_rad_s, ax, ay)
            self._suspect = None
            return False
        self._suspect = (rate_rad_s, ax, ay)
        return True

    def _is_beyond_scale(self, rate_rad_s: float, ax: float, ay: float) -> bool:
        """Whether no sensor can have read this; NaN and infinity among it."""
        rate, force = self._full_rate, self._full_acc
        return not (-rate <= rate_rad_s <= rate and -force <= ax <= force and -force <= ay <= force)
