"""Fixes that no vehicle on a table can have, whatever an estimator believes."""

from __future__ import annotations

import math

from groundstation.fusion.estimator import Fix

MAX_PLAUSIBLE = 1e3
"""No table is a kilometre wide, and no fix's heading is that many radians."""


def complaint_about(fix: Fix) -> str | None:
    """Return why a fix is refused unseen, or None."""
    reported = (fix.x_m, fix.y_m, fix.heading_rad, *fix.covariance.ravel().tolist())
    if not all(map(math.isfinite, reported)):
        return "not finite"
    if max(abs(fix.x_m), abs(fix.y_m), abs(fix.heading_rad)) > MAX_PLAUSIBLE:
        return "not on any table"
    return None
