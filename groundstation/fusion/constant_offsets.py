"""Constant offsets fitted in the loop: an addition of ours to the published joint method."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from groundstation.fusion.offset_fit import OffsetFit, fit_offsets
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.star_states import StarPose

LEAST_FIXES = 4


def fit_while_flying(
    history: PacketHistory, flight: Sequence[StarPose], null_rad_s: float, sigma_m: float
) -> OffsetFit | None:
    """Fit the offsets over a flight; None where it has too few fixes.

    Args:
        history: Packets from before the first fix until the last.
        flight: Fixes of the flight, ascending.
        null_rad_s: Of the gyro.
        sigma_m: Of a fix, per axis.
    """
    if len(flight) < LEAST_FIXES:
        return None
    t = np.array([pose.t_s for pose in flight])
    segment = history.between(t[0] - 0.1, t[-1])
    step = (segment.rate_rad_s - null_rad_s) * segment.span_s
    turned = np.cumsum(step)
    heading = flight[0].heading_rad + turned - np.interp(t[0], segment.end_s, turned) - 0.5 * step
    force = np.array([segment.ax_m_s2, segment.ay_m_s2])
    points = np.array([[pose.x_m for pose in flight], [pose.y_m for pose in flight]])
    return fit_offsets(segment.end_s, segment.span_s, heading, force, t, points, sigma_m)
