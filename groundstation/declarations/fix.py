"""What a fix is, whoever makes it: the pose of a mock-up at an exposure, with its covariance.

A part that makes fixes declares a ``FixSource``; the estimator takes the sources that the rig names, and
knows none of them by name.
"""

from collections.abc import Callable
from dataclasses import dataclass

from groundstation.declarations.message import F64, Bool, Float64x9, Message
from groundstation.declarations.rig import Rig

Floor = tuple[float, float]
"""What calibration leaves in every fix beyond its own covariance: x and y (m), heading (rad)."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseFix(Message):
    """What every fix begins with; the stamp is the middle of the exposure.

    Attributes:
        fix: Whether there is a pose; without one the pose is NaN.
        x_m: Body origin in the table frame.
        y_m: Body origin in the table frame.
        heading_rad: Heading in [-pi, pi).
        covariance: Row-major 3 x 3 of (x, y, heading) in m and rad.
        stamp_sigma_s: Standard deviation of the stamp against the host's clock.
    """

    fix: Bool
    x_m: F64
    y_m: F64
    heading_rad: F64
    covariance: Float64x9
    stamp_sigma_s: F64


@dataclass(frozen=True, slots=True)
class FixSource:
    """A kind of fixes that an estimator may take.

    Attributes:
        name: The rig's word, in ``fix_sources``.
        payload: Class of its fixes.
        condition: Whether a vehicle has it.
        floor: What calibration leaves in every fix.
        needs: What a rig lacks where the condition does not hold, for people.
    """

    name: str
    payload: type[PoseFix]
    condition: Callable[[Rig, str], bool]
    floor: Callable[[Rig, str], Floor]
    needs: str
