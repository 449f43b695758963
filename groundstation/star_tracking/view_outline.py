"""The outline of the picture on the ceiling: is a place shown, without projecting it.

The pixels of the picture's border, carried to the ceiling once, give the distance of the outline from
the picture's middle as a function of direction. A place is shown if it is nearer than that. Unlike a
projection this does not fold far places back into the picture, as a polynomial distortion does.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.rays import ceiling_points

_STEP_PX = 2.0  # chords between border points stay within 0.01 px of the border


class ViewOutline:
    """What of the ceiling a camera shows, body axes.

    Args:
        camera: Its calibration.
        margin_px: Places nearer than this to the picture's edge count as not shown.
    """

    def __init__(self, camera: CameraCalibration, margin_px: float) -> None:
        right, low = camera.width - 1.0 - margin_px, camera.height - 1.0 - margin_px
        along_u = np.linspace(margin_px, right, max(int((right - margin_px) / _STEP_PX), 1) + 1)
        along_v = np.linspace(margin_px, low, max(int((low - margin_px) / _STEP_PX), 1) + 1)
        u = np.concatenate((along_u, along_u, np.full_like(along_v, margin_px), np.full_like(along_v, right)))
        v = np.concatenate((np.full_like(along_u, margin_px), np.full_like(along_u, low), along_v, along_v))
        middle = 0.5 * np.array([camera.width - 1.0, camera.height - 1.0])
        points, _ = ceiling_points(camera, np.append(u, middle[0]), np.append(v, middle[1]))
        q = points[:, 0] + 1j * points[:, 1]
        self._middle = complex(q[-1])
        spoke = q[:-1] - self._middle
        direction, first = np.unique(np.angle(spoke), return_index=True)
        distance = np.abs(spoke[first])
        turn = 2.0 * np.pi  # the first and last once more, so that the table closes
        self._direction = np.concatenate(([direction[-1] - turn], direction, [direction[0] + turn]))
        self._distance = np.concatenate(([distance[-1]], distance, [distance[0]]))

    def shows(self, q_body_m: NDArray[np.complex128]) -> NDArray[np.bool_]:
        """Tell which places x + iy of the ceiling, relative to the body origin, are in the picture."""
        spoke = q_body_m - self._middle
        limit = np.interp(np.arctan2(spoke.imag, spoke.real), self._direction, self._distance)
        return np.asarray(np.abs(spoke) < limit)
