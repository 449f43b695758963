"""Place of a plain upright cylinder of known size from the part of it that a lamp lights.

The unlit side cannot be seen, so neither the width nor the middle of the patch says where the body is. What
can be seen sharply are the upper and the lower edge over each lit column, whose distance gives the depth of
that column, and the limb on the lamp's side. Between the limb and the terminator the brightness falls as
Lambert's law has it for the lamp's direction, which is found along with the rest. All three are fitted
together: unknown are the place (2), the lamp's direction in the plane, its level, and the light from
everywhere else. Where the whole body is lit, or its dark side is bright enough to be seen, the other limb
counts by itself.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from groundstation.relative_navigation.lit_patch import BLUR_PX, LitPatch, measure_lit_part
from groundstation.relative_navigation.side_bodies import SideBody
from groundstation.relative_navigation.side_camera import SideCamera
from groundstation.relative_navigation.sighting import Seen, Unseen, seen_at

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

FINE = 3
"""Points of the model in a column."""
LAMPS = 20
"""Directions of the lamp that the fit is begun from."""
STEPS = 40
WORST_MISFIT = 3.0
"""Mean square of the residuals beyond which the patch is another body's; 0.2 to 1 where the model holds."""
RUN = 7
"""Columns in a row whose residuals are summed: noise has no sign in common, a cut has."""
WORST_RUN = 4.7
"""Of such a sum, in sigmas, beyond which something hides a part of the body, or lights it otherwise."""
MODEL_SHARE = 0.3
"""Of what the model is said to leave of each column's brightness, that which goes together over columns."""
WORST_EDGE_RUN = 6.0
"""The same of the upper and lower edges, whose sigmas hold what the lens bends."""
SURE = 25.0
"""By so much another place must fit worse, in squared sigmas."""
OTHER_M = 0.02
"""Places this far apart are two."""
WEAKEST = 1e-9


def find_by_lit_part(camera: SideCamera, body: SideBody, picture: Picture) -> Seen | Unseen:
    """Find a body in one picture.

    Args:
        camera: The camera.
        body: Its radius and heights.
        picture: Grey, (h, w).
    """
    patch = measure_lit_part(picture)
    return patch if isinstance(patch, Unseen) else _solved(camera, body, patch)


class _Model:
    """Predicts a patch from place and light.

    Parameters of the fit: across and depth of the cylinder's axis in camera axes (m), direction of the lamp
    in the plane (rad, from the line towards the camera, to the right), level and ambient (grey steps).
    """

    def __init__(self, camera: SideCamera, body: SideBody, patch: LitPatch) -> None:
        self._camera, self._body, self._patch = camera, body, patch
        fine = (np.arange(FINE) + 0.5) / FINE - 0.5
        self._fine_u = (patch.columns[:, None] + fine).ravel()
        half = math.ceil(3.0 * BLUR_PX * FINE)
        kernel = np.exp(-0.5 * (np.arange(-half, half + 1) / (BLUR_PX * FINE)) ** 2)
        self._kernel = kernel / kernel.sum()

    def residuals(self, parameters: Floats) -> Floats:
        """Whitened, (n + 2 k,)."""
        patch = self._patch
        profile = self._profile(parameters)
        upper, lower = self._edges(parameters)
        return np.concatenate((
            (profile - patch.profile) / patch.profile_sigma,
            (upper - patch.upper) / patch.edge_sigma,
            (lower - patch.lower) / patch.edge_sigma,
        ))  # fmt: skip

    def starts(self, depth_m: float, ends: tuple[float, float]) -> list[Floats]:
        """Where to begin the fit from: the best of many lamps, on either side.

        Args:
            depth_m: Rough one of the axis.
            ends: Slopes of the rays towards the outermost lit columns, left and right.
        """
        patch, radius_m = self._patch, self._body.radius_m
        rated: list[tuple[float, bool, Floats]] = []
        for lamp_rad in np.linspace(-2.8, 2.8, LAMPS):
            is_right = lamp_rad > 0.0  # the limb on the lamp's side is the one that is seen
            across_m = (ends[1] if is_right else ends[0]) * depth_m - math.copysign(radius_m, lamp_rad)
            shape = self._profile(np.array((across_m, depth_m, lamp_rad, 1.0, 0.0)))
            weight = 1.0 / patch.profile_sigma**2
            level = max(float(weight @ (shape * patch.profile)), WEAKEST) / max(
                float(weight @ shape**2), WEAKEST
            )
            off = (level * shape - patch.profile) / patch.profile_sigma
            start = np.array((across_m, depth_m, lamp_rad, max(level, 2.0 * WEAKEST), WEAKEST))
            rated.append((float(off @ off), bool(is_right), start))
        rated.sort(key=lambda row: row[0])
        best = rated[:2]
        best += [row for row in rated[2:] if row[1] != rated[0][1]][:1]
        return [start for _, _, start in best]

    def _covered(self, across_m: float, depth_m: float) -> Floats:
        """Share of each point of the model between the two limbs."""
        lens, width_px = self._camera.lens, 1.0 / FINE
        middle = math.atan2(across_m, depth_m)
        half = math.asin(min(1.0, self._body.radius_m / math.hypot(across_m, depth_m)))
        low, high = (
            lens.cx_px + lens.f_px * math.tan(max(-1.5, min(1.5, middle + side * half)))
            for side in (-1.0, 1.0)
        )
        begins = np.maximum(self._fine_u - 0.5 * width_px, low)
        ends = np.minimum(self._fine_u + 0.5 * width_px, high)
        share: Floats = np.clip((ends - begins) / width_px, 0.0, 1.0)
        return share

    def _depths(self, u: Floats, across_m: float, depth_m: float) -> Floats:
        """Depth of the near side over columns; beyond the limb that of the limb."""
        slope = (u - self._camera.lens.cx_px) / self._camera.lens.f_px
        a, b = 1.0 + slope**2, slope * across_m + depth_m
        under = b * b - a * (across_m**2 + depth_m**2 - self._body.radius_m**2)
        near: Floats = (b - np.sqrt(np.maximum(under, 0.0))) / a
        return near

    def _profile(self, parameters: Floats) -> Floats:
        across_m, depth_m, lamp_rad, level, ambient = parameters
        depth = self._depths(self._fine_u, across_m, depth_m)
        slope = (self._fine_u - self._camera.lens.cx_px) / self._camera.lens.f_px
        normal_x = (slope * depth - across_m) / self._body.radius_m
        normal_z = (depth - depth_m) / self._body.radius_m
        lit = np.maximum(0.0, normal_x * math.sin(lamp_rad) - normal_z * math.cos(lamp_rad))
        light = (level * lit + ambient) * self._covered(across_m, depth_m)
        blurred = np.convolve(light, self._kernel, mode="same")
        mean: Floats = blurred.reshape(-1, FINE).mean(axis=1)
        return mean

    def _edges(self, parameters: Floats) -> tuple[Floats, Floats]:
        depth = self._depths(self._patch.edge_columns, parameters[0], parameters[1])
        lens, eye_m = self._camera.lens, self._camera.position_body_m[2]
        scale = lens.f_px / np.maximum(depth, 1e-3)
        return (
            lens.cy_px + scale * (eye_m - self._body.top_m),
            lens.cy_px + scale * (eye_m - self._body.bottom_m),
        )


def _solved(camera: SideCamera, body: SideBody, patch: LitPatch) -> Seen | Unseen:
    """The place by least squares from several directions of the lamp."""
    model = _Model(camera, body, patch)
    lens = camera.lens
    heights_px = float(np.median(patch.lower - patch.upper))
    near_m = lens.f_px * (body.top_m - body.bottom_m) / max(heights_px, 1.0)
    depth_m = near_m + 0.7 * body.radius_m
    ends = (patch.edge_columns[0] - lens.cx_px) / lens.f_px, (patch.edge_columns[-1] - lens.cx_px) / lens.f_px
    brightest = float(patch.profile.max())
    found = []
    for start in model.starts(depth_m, ends):
        result = least_squares(
            model.residuals,
            start,
            bounds=(
                [-np.inf, body.radius_m, -4.0, WEAKEST, 0.0],
                [np.inf, 20.0, 4.0, 50.0 * brightest, np.inf],
            ),
            x_scale=(0.05, 0.1, 0.3, brightest, 0.1 * brightest),
            ftol=1e-6,
            xtol=1e-7,
            max_nfev=STEPS,
        )
        found.append((2.0 * float(result.cost), result))
    found.sort(key=lambda row: row[0])
    cost, best = found[0]
    freedom = max(1, len(best.fun) - 5)
    misfit = cost / freedom
    if misfit > WORST_MISFIT:
        return Unseen(
            f"the lit part is none of {body.vehicle}: its outline misses by {misfit**0.5:.0f} sigmas"
        )
    if _is_cut(patch, best.fun):
        return Unseen(f"the lit part is none of {body.vehicle}, or something hides a part of it")
    for other_cost, other in found[1:]:
        if np.hypot(*(other.x[:2] - best.x[:2])) > OTHER_M and other_cost < cost + SURE * max(1.0, misfit):
            return Unseen("two places explain the lit part alike", is_ambiguous=True)
    slopes: Floats = np.asarray(best.jac, dtype=np.float64)
    information = slopes.T @ slopes
    held = 1e-9 * np.diag(information) + 1e-12  # what nothing depends on, as the light of a body seen whole
    held[:2] = 0.0
    covariance = np.linalg.inv(information + np.diag(held))[:2, :2] * max(1.0, misfit)
    right, ahead = camera.axes_body
    turn = np.column_stack((right, ahead))
    place = np.array(camera.position_body_m[:2]) + turn @ best.x[:2]
    whole = np.zeros((3, 3))
    whole[:2, :2] = turn @ covariance @ turn.T
    whole[2, 2] = math.inf
    return seen_at(place, math.nan, whole, len(patch.edge_columns), misfit)


def _is_cut(patch: LitPatch, residuals: Floats) -> bool:
    """Whether neighbouring columns miss the model alike.

    An outline that ends in a cut instead of at a limb or the terminator does: the fit spreads such a miss so
    thinly that its mean square tells nothing.
    """
    columns, edges = len(patch.columns), len(patch.edge_columns)
    noise2 = patch.profile_noise**2
    model2 = np.maximum(patch.profile_sigma**2 - noise2, 0.0)
    narrow = patch.profile_sigma / np.sqrt(noise2 + MODEL_SHARE**2 * model2)
    profile = residuals[:columns] * narrow
    upper, lower = residuals[columns : columns + edges], residuals[columns + edges :]
    return _longest(profile) > WORST_RUN or max(_longest(upper), _longest(lower)) > WORST_EDGE_RUN


def _longest(residuals: Floats) -> float:
    """The largest sum over `RUN` residuals in a row, in sigmas of such a sum."""
    count = min(RUN, len(residuals))
    sums = np.convolve(residuals, np.ones(count), mode="valid") / math.sqrt(count)
    return float(np.abs(sums).max())
