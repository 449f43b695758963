"""One recorded flight as arrays: what the accelerometers felt, and where the stars saw the vehicle."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FlightLog:
    """A flight, smoothed well enough that heading and place are known; n packets, k fixes.

    Times are seconds since an origin of the log's own. The accelerometers may stand apart from the centre of
    mass; fixes are of the body's origin, which is the centre of mass.
    """

    name: str
    end_s: Array
    """(n,) end of each packet, rising. A hole is a packet of its own."""
    span_s: Array
    """(n,) its length; packets touch each other."""
    force_body_m_s2: Array
    """(n, 2) mean specific force as read, bias and all; made up from the neighbours in a hole."""
    warmth_k: Array
    """(n,) temperature above the reference temperature of the bias, zero where unknown."""
    heading_rad: Array
    """(n,) in the middle of the motion that the packet felt, unwrapped."""
    position_table_m: Array
    """(n, 2) there."""
    is_hole: NDArray[np.bool_]
    """(n,)."""
    fix_s: Array
    """(k,) exposures on the packets' clock (later by the accelerometers' lag), rising."""
    fix_position_m: Array
    """(k, 2)."""
    fix_covariance_m2: Array
    """(k, 2, 2)."""
    fix_heading_rad: Array
    """(k,) smoothed."""
    fix_velocity_m_s: Array
    """(k, 2) smoothed, table frame."""
    rests_s: tuple[tuple[float, float], ...]
    """Stretches during which the vehicle stood still."""
    imu_body_m: tuple[float, float]
    """Accelerometers from the centre of mass."""
    acc_density_m_s2_rthz: float
    """White noise of the specific force."""

    def __post_init__(self) -> None:
        n, k = len(self.end_s), len(self.fix_s)
        packet = {"span_s", "force_body_m_s2", "warmth_k", "heading_rad", "position_table_m", "is_hole"}
        fix = {"fix_position_m", "fix_covariance_m2", "fix_heading_rad", "fix_velocity_m_s"}
        for field in fields(self):
            wanted = n if field.name in packet else k if field.name in fix else None
            if wanted is not None:
                value = getattr(self, field.name)
                if len(value) != wanted:
                    raise ValueError(f"{field.name} must have {wanted} rows, found {len(value)}")
                if not np.isfinite(value).all():
                    raise ValueError(f"{field.name} must be finite")
        if (np.diff(self.end_s) <= 0.0).any() or (np.diff(self.fix_s) < 0.0).any():
            raise ValueError("stamps of packets and fixes must rise")
        if not self.acc_density_m_s2_rthz > 0.0:
            raise ValueError("acc_density_m_s2_rthz must be above zero")

    def is_resting(self, t_s: Array) -> NDArray[np.bool_]:
        """Return whether the vehicle stood still, (m,), at times (m,)."""
        found = np.zeros(len(t_s), dtype=np.bool_)
        for start_s, stop_s in self.rests_s:
            found |= (t_s > start_s) & (t_s <= stop_s)
        return found
