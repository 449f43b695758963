"""One rigid body as one frame of a motion-capture system saw it."""

import math
from dataclasses import dataclass

_NOWHERE_M = (math.nan, math.nan, math.nan)
_UNTURNED = (math.nan, math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class MotionCapturePose:
    """A pose in the system's own frame, which is the business of who knows where the cameras hang.

    When the cameras exposed is not known: the library gives no stamp. The arrival's stamp minus the system's
    delay is the best there is.

    Attributes:
        name: Of the rigid body, as the system calls it.
        frame: Counts the frames that were read, from 0; all bodies of one frame bear the same number.
        position_m: Of the body's pivot, capture frame; NaN where not tracked.
        quaternion_xyzw: Unit, scalar last: turns body axes into the capture frame's; NaN where not tracked.
        is_tracked: Whether the cameras saw it.
    """

    name: str
    frame: int
    position_m: tuple[float, float, float]
    quaternion_xyzw: tuple[float, float, float, float]
    is_tracked: bool

    @classmethod
    def untracked(cls, name: str, frame: int) -> "MotionCapturePose":
        """A body that the cameras did not see in that frame."""
        return cls(name, frame, _NOWHERE_M, _UNTURNED, is_tracked=False)
