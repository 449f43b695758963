"""A pose measured from outside, as the stream gives it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.quick_record import quickly_made

_ROWS, _COLUMNS = (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)  # xx, xy, xh, yy, yh, hh


@quickly_made
@dataclass(frozen=True, slots=True)
class ReferencePose:
    """Pose of one vehicle's body origin in the table frame at one moment.

    Attributes:
        vehicle: Index of the vehicle on the table, 0..255.
        sequence: +1 modulo 65536 per pose of that vehicle.
        stamp_source_ns: Moment of the measurement on the source's own clock.
        age_ns: From the measurement to the sending of its first byte, 0 to 4.29 s.
        is_host_clock: The source's clock is the monotonic clock of the host that receives.
        is_tracked: False where the source lost the vehicle; pose and velocity are then not to be used.
        position_table_m: (x, y).
        heading_rad: Counter-clockwise from table +x to body +x.
        velocity_table_m_s: (vx, vy); NaN where the source does not measure it.
        rate_rad_s: Counter-clockwise; NaN where the source does not measure it.
        pose_covariance: xx, xy, xh, yy, yh, hh of (x, y, heading) in m and rad; zeros for truth.
    """

    vehicle: int
    sequence: int
    stamp_source_ns: int
    age_ns: int
    position_table_m: tuple[float, float]
    heading_rad: float
    velocity_table_m_s: tuple[float, float] = (math.nan, math.nan)
    rate_rad_s: float = math.nan
    pose_covariance: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    is_host_clock: bool = False
    is_tracked: bool = True

    def covariance_matrix(self) -> NDArray[np.float64]:
        """Covariance of (x, y, heading), shape (3, 3), in m and rad."""
        matrix = np.empty((3, 3))
        matrix[_ROWS, _COLUMNS] = self.pose_covariance
        matrix[_COLUMNS, _ROWS] = self.pose_covariance
        return matrix

    def measured_stamp_ns(self, arrival_stamp_ns: int) -> int:
        """Moment of the measurement on the host's clock.

        Exact where both share a clock; otherwise arrival minus age, late by what the link took.
        """
        return self.stamp_source_ns if self.is_host_clock else arrival_stamp_ns - self.age_ns
