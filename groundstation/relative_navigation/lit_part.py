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
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from groundstation.relative_navigation.intensity import Background, background_of
from groundstation.relative_navigation.outlines import Blob, blobs_of
from groundstation.relative_navigation.side_bodies import SideBody
from groundstation.relative_navigation.side_camera import SideCamera
from groundstation.relative_navigation.sighting import Seen, Unseen, seen_at

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

SIGMAS = 6.0
"""Of the noise: how far a pixel of the lit part stands above the background."""
RIM_PX = 30
LEAST_ROWS, LEAST_COLUMNS = 24, 6
RIVAL_SHARE = 0.15
"""Another patch with such a share of the largest one's area may be the body as well."""
SATURATED, FLOODED_SHARE = 250, 0.0005
"""Of the picture that is over-exposed: more is the lamp, or a body whose brightness tells nothing."""
EDGE_ROWS = 4
"""Half the window in which the light of an upper or lower edge is counted."""
EDGE_FLOOR_PX, PROFILE_FLOOR = 0.05, 0.01
"""What the model leaves of a perfect picture: of an edge, and of brightness as a share of the brightest."""
PLACE_FLOOR_PX = 0.05
"""The same of where a column lies: counts where the brightness is steep."""
CONTRAST_SIGMAS = 12.0
"""A column's level over its noise from which its edges are used."""
BLUR_PX = 0.8
FINE = 3
"""Points of the model in a column."""
LAMPS = 20
"""Directions of the lamp that the fit is begun from."""
STEPS = 40
WORST_MISFIT = 30.0
SURE = 25.0
OTHER_M = 0.02
"""Places this far apart are two."""
WEAKEST = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class _Patch:
    """What is measured of the lit part, by columns.

    Attributes:
        columns: Of the profile, from some way outside the patch on the left to as far on the right, (n,).
        profile: Mean light over the rows in the middle, above the background, (n,).
        profile_sigma: Its noise, (n,).
        edge_columns: Those whose edges are sharp, (k,).
        upper, lower: Rows of the edges, (k,).
        edge_sigma: Of each, (k,).
    """

    columns: Floats
    profile: Floats
    profile_sigma: Floats
    edge_columns: Floats
    upper: Floats
    lower: Floats
    edge_sigma: Floats


def find_by_lit_part(camera: SideCamera, body: SideBody, picture: Picture) -> Seen | Unseen:
    """Find a body in one picture.

    Args:
        camera: The camera.
        body: Its radius and heights.
        picture: Grey, (h, w).
    """
    background = _dark(picture)
    if np.count_nonzero(picture >= SATURATED) > FLOODED_SHARE * picture.size:
        return Unseen("over-exposed: the lamp is in view, or it shines too bright")
    blob = _lit_blob(picture, background)
    if isinstance(blob, Unseen):
        return blob
    patch = _measured(picture, blob, background)
    if isinstance(patch, Unseen):
        return patch
    return _solved(camera, body, patch)


def _dark(picture: Picture) -> Background:
    """Background of a picture that a near body may fill by more than half: then its rim tells more."""
    above_and_below = np.concatenate((picture[:RIM_PX], picture[-RIM_PX:]))
    beside = np.concatenate((picture[:, :RIM_PX], picture[:, -RIM_PX:]), axis=1)
    parts = (picture, above_and_below, np.ascontiguousarray(beside))
    return min(map(background_of, parts), key=lambda found: found.level)


def _lit_blob(picture: Picture, background: Background) -> Blob | Unseen:
    """The one patch that may be the body."""
    level = math.ceil(background.level + SIGMAS * background.sigma)
    blobs = [blob for blob in blobs_of(picture, level) if blob.box[2] > 2 and blob.box[3] > 2]
    if not blobs:
        return Unseen("nothing is lit" if background.level < 40.0 else "nothing stands out of the background")
    areas = np.array([blob.box[2] * blob.box[3] for blob in blobs])
    blob = blobs[int(np.argmax(areas))]
    if np.sort(areas)[-2:][0] > RIVAL_SHARE * areas.max() and len(areas) > 1:
        return Unseen("more than one lit body is in view", is_ambiguous=True)
    left, top, right, bottom = blob.touches
    if blob.box[3] < LEAST_ROWS or blob.box[2] < LEAST_COLUMNS:
        return Unseen(f"the lit part has {blob.box[2]} x {blob.box[3]} px, too few to be measured")
    if top <= EDGE_ROWS or bottom >= picture.shape[0] - 1 - EDGE_ROWS:
        return Unseen("the upper or lower edge of the body is out of view")
    if left <= EDGE_ROWS or right >= picture.shape[1] - 1 - EDGE_ROWS:
        return Unseen("the edge of the picture cuts the lit part")
    return blob


def _measured(picture: Picture, blob: Blob, background: Background) -> _Patch | Unseen:
    left, top, right, bottom = blob.touches
    margin = max(8, blob.box[2] // 8)
    first, last = max(0, left - margin), min(picture.shape[1] - 1, right + margin)
    columns = np.arange(first, last + 1)
    middle = slice(top + blob.box[3] // 4, bottom - blob.box[3] // 4)
    light = picture[middle, first : last + 1].astype(float) - background.level
    count = light.shape[0]
    profile = np.median(light, axis=0) if count < 8 else _trimmed_mean(light)
    noise = background.sigma**2 + np.maximum(profile, 0.0) * _shot_gain(light, profile, background)
    steep = PLACE_FLOOR_PX * np.abs(np.gradient(profile))
    sigma = np.sqrt(noise / count + (PROFILE_FLOOR * max(profile.max(), 1.0)) ** 2 + steep**2)
    lit = np.flatnonzero(profile > CONTRAST_SIGMAS * np.sqrt(noise / count) + 2.0 * background.sigma)
    lit = lit[(lit > 1) & (lit < len(columns) - 2)]
    if len(lit) < LEAST_COLUMNS:
        return Unseen("the lit part is too faint to be measured")
    upper, lower, spread = [], [], []
    rows = np.arange(picture.shape[0], dtype=float)
    for index in lit.tolist():
        ray = picture[:, columns[index]].astype(float) - background.level
        level = profile[index]
        above, below = _crossings(ray, level, top, bottom)
        inside = math.sqrt(noise[index]) / level
        found = []
        for rough, sign in ((above, 1.0), (below, -1.0)):
            low = max(0, round(rough) - EDGE_ROWS)
            window = slice(low, min(len(rows), round(rough) + EDGE_ROWS + 1))
            share = ray[window] / level
            # the light in the window says how many of its rows are covered: the edge, whatever the lens blurs
            covered = float(share.sum())
            found.append(rows[window][-1] + 0.5 - covered if sign > 0 else rows[window][0] - 0.5 + covered)
        upper.append(found[0])
        lower.append(found[1])
        spread.append(inside * math.sqrt(2.0 * EDGE_ROWS + 1.0))
    # the lens mixes neighbouring columns: where the brightness rises, what is seen lies on the brighter side
    moved = np.clip(BLUR_PX**2 * (np.gradient(profile) / np.maximum(profile, 1.0))[lit], -1.5, 1.5)
    bent = np.abs(np.gradient(np.gradient(upper))) * 0.5 * BLUR_PX**2
    unsure = np.abs(np.gradient(upper)) * np.abs(moved)
    edge_sigma = np.sqrt(np.square(spread) + EDGE_FLOOR_PX**2 + bent**2 + unsure**2)
    return _Patch(
        columns.astype(float),
        profile,
        sigma,
        columns[lit] + moved,
        np.array(upper),
        np.array(lower),
        edge_sigma,
    )


def _trimmed_mean(light: Floats) -> Floats:
    """Mean over the rows without the eighth at either end: a hot pixel does not count."""
    ordered = np.sort(light, axis=0)
    cut = len(ordered) // 8
    mean: Floats = ordered[cut : len(ordered) - cut].mean(axis=0)
    return mean


def _shot_gain(light: Floats, profile: Floats, background: Background) -> float:
    """How much the variance grows with the light, from the scatter of the rows."""
    bright = profile > 0.3 * profile.max()
    excess = float(np.median(light[:, bright].var(axis=0))) - background.sigma**2
    return max(0.0, excess / max(float(np.median(profile[bright])), 1.0))


def _crossings(ray: Floats, level: float, top: int, bottom: int) -> tuple[float, float]:
    """Rows where a column passes half its level, outermost ones around the patch."""
    low, high = max(0, top - 3), min(len(ray), bottom + 4)
    bright = np.flatnonzero(ray[low:high] > 0.5 * level)
    if not len(bright):
        return float(top), float(bottom)
    return float(low + bright[0]) - 0.5, float(low + bright[-1]) + 0.5


class _Model:
    """Predicts a patch from place and light.

    Parameters of the fit: across and depth of the cylinder's axis in camera axes (m), direction of the lamp
    in the plane (rad, from the line towards the camera, to the right), level and ambient (grey steps).
    """

    def __init__(self, camera: SideCamera, body: SideBody, patch: _Patch) -> None:
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


def _solved(camera: SideCamera, body: SideBody, patch: _Patch) -> Seen | Unseen:
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
    for other_cost, other in found[1:]:
        if np.hypot(*(other.x[:2] - best.x[:2])) > OTHER_M and other_cost < cost + SURE * max(1.0, misfit):
            return Unseen("two places explain the lit part alike", is_ambiguous=True)
    information = best.jac.T @ best.jac
    held = information + np.diag((0.0, 0.0, *(1e-9 * np.diag(information)[2:] + 1e-12)))
    covariance = np.linalg.inv(held)[:2, :2] * max(1.0, misfit)
    right, ahead = camera.axes_body
    turn = np.column_stack((right, ahead))
    place = np.array(camera.position_body_m[:2]) + turn @ best.x[:2]
    whole = np.zeros((3, 3))
    whole[:2, :2] = turn @ covariance @ turn.T
    whole[2, 2] = math.inf
    return seen_at(place, math.nan, whole, len(patch.edge_columns), misfit)
