"""Place and turn of a body that moves on the camera's table, from the markers on its hull.

Known are the camera's height and direction and each marker's height, so only three numbers are sought: x, y
and heading. One spot taken for one marker already gives a place (its height above or below the camera over
its row is the depth); two such places must be as far apart as the two markers: pairs that are give poses,
each pose is judged by how many spots it explains, and the best ones are fitted by Gauss and Newton. Each
picture stands on its own, so nothing of an earlier mistake remains.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.side_bodies import SideBody
from groundstation.relative_navigation.side_camera import SideCamera
from groundstation.relative_navigation.sighting import Seen, Unseen, seen_at

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FEWEST = 3
"""Markers of a pose: two always fit some pair of a dozen."""
MOST_SPOTS = 40
"""More are no body with markers; the work grows with their square."""
CENTRE_FLOOR_PX = 0.012
"""What the model of a disk leaves of the picture of a round sticker on a curved hull."""
HIGHER_M = 0.03
"""A marker nearer to the camera's own height says nothing of the depth by itself."""
MOST_PAIRS, MOST_JUDGED = 200_000, 6_000_000
"""Pairs of spots taken for markers, and marker images that are compared with spots; beyond, every so many-th
is looked at: enough of a body that shows many markers is left, and a picture takes a bounded time."""
APART_M = 0.025
"""By how much the distance of two places may differ from that of their markers."""
GRAZING = 0.12
"""Cosine of the line of sight with a marker's surface from which it may be seen."""
GATE_PX, FINE_PX = 8.0, 3.0
"""How far from its prediction a spot is looked for: before a fit, and after one."""
CANDIDATES = 12
STEPS = 6
SURE = 16.0
"""By so much the next best pose must fit worse, in squared sigmas."""
WORST_MISFIT = 25.0
"""Mean square of the residuals beyond which the spots are no markers of the body."""
OTHER_M, OTHER_RAD = 0.03, 0.1
"""Poses this far apart are two."""


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    pose: Floats  # x, y in the own body frame, heading
    covariance: Floats
    cost: float
    matched: int

    @property
    def misfit(self) -> float:
        return self.cost / max(1, 2 * self.matched - 3)


def find_by_markers(camera: SideCamera, body: SideBody, centres: Centres) -> Seen | Unseen:
    """Find a body in the spots of one picture.

    Args:
        camera: The camera.
        body: With markers.
        centres: Of the spots, with covariances.
    """
    if len(centres) < FEWEST:
        return Unseen(f"{len(centres)} spots in the picture, at least {FEWEST} markers are needed")
    if len(centres) > MOST_SPOTS:
        return Unseen(f"{len(centres)} spots in the picture, more than {MOST_SPOTS}: no body has so many")
    search = _Search(camera, body, centres)
    fits = search.fits()
    if not fits:
        return Unseen(f"no pose of {body.vehicle} explains {FEWEST} of the {len(centres)} spots")
    best = fits[0]
    if best.misfit > WORST_MISFIT:
        return Unseen(f"the spots miss the markers of {body.vehicle} by {best.misfit**0.5:.0f} sigmas")
    for other in fits[1:]:
        if other.matched >= best.matched and other.cost < best.cost + SURE * max(1.0, best.misfit):
            return Unseen(f"two poses of {body.vehicle} explain the spots alike", is_ambiguous=True)
    covariance = best.covariance * max(1.0, best.misfit)
    return seen_at(best.pose[:2].copy(), float(best.pose[2]), covariance, best.matched, best.misfit)


class _Search:
    """The spots of one picture against one body."""

    def __init__(self, camera: SideCamera, body: SideBody, centres: Centres) -> None:
        self._camera, self._centres = camera, centres
        self._points = body.points_body_m()
        self._right, self._ahead = camera.axes_body
        self._eye = np.array(camera.position_body_m)
        spread = centres.covariances + CENTRE_FLOOR_PX**2 * np.eye(2)
        self._whiten = np.linalg.inv(np.linalg.cholesky(spread))
        azimuth = np.array(body.azimuths_rad)
        self._body = body
        self._normals = np.column_stack((np.cos(azimuth), np.sin(azimuth)))

    def fits(self) -> list[_Fit]:
        """Fitted poses that explain enough spots, the best first, each once."""
        starts = self._starts()
        if not len(starts):
            return []
        counts = np.array([len(self._matched(start, GATE_PX)[0]) for start in starts])
        order = np.argsort(-counts, kind="stable")
        kept: list[_Fit] = []
        for row in order[: 4 * CANDIDATES].tolist():
            if counts[row] < FEWEST or any(_is_near(fit.pose, starts[row]) for fit in kept):
                continue
            fit = self._fitted(starts[row])
            if fit is not None and not any(_is_near(other.pose, fit.pose) for other in kept):
                kept.append(fit)
            if len(kept) >= CANDIDATES:
                break
        return sorted(kept, key=lambda fit: (-fit.matched, fit.cost))

    def _starts(self) -> Floats:
        """Rough poses from all pairs of spots taken for pairs of markers, (n, 3)."""
        lens, points = self._camera.lens, self._points
        above_m = self._eye[2] - points[:, 2]
        rows_px = self._centres.pixels[:, 1] - lens.cy_px
        with np.errstate(divide="ignore", invalid="ignore"):
            depth_m = lens.f_px * above_m[None] / rows_px[:, None]
        usable = (np.abs(above_m)[None] >= HIGHER_M) & (depth_m > 0.1) & (depth_m < 10.0)
        spot, marker = np.nonzero(usable)
        depth = depth_m[spot, marker]
        across = depth * (self._centres.pixels[spot, 0] - lens.cx_px) / lens.f_px
        places = self._eye[:2] + across[:, None] * self._right + depth[:, None] * self._ahead
        first, second = pairs_of(len(spot))
        other = (spot[first] != spot[second]) & (marker[first] != marker[second])
        first, second = first[other], second[other]
        seen = places[second] - places[first]
        known = points[marker[second], :2] - points[marker[first], :2]
        long = np.linalg.norm(known, axis=1)
        fit = (np.abs(np.linalg.norm(seen, axis=1) - long) < APART_M) & (long > APART_M)
        seen, known, first, second = seen[fit], known[fit], first[fit], second[fit]
        turn = np.arctan2(known[:, 0] * seen[:, 1] - known[:, 1] * seen[:, 0], np.sum(known * seen, axis=1))
        cosine, sine = np.cos(turn), np.sin(turn)
        middle = 0.5 * (places[first] + places[second])
        own = 0.5 * (points[marker[first], :2] + points[marker[second], :2])
        x = middle[:, 0] - cosine * own[:, 0] + sine * own[:, 1]
        y = middle[:, 1] - sine * own[:, 0] - cosine * own[:, 1]
        starts = np.column_stack((x, y, turn))
        return starts[self._agreeing(starts)]

    def _agreeing(self, starts: Floats) -> Ints:
        """Those of many poses that explain the most spots, as far as one look tells; at most some dozens."""
        if not len(starts):
            return np.empty(0, np.int64)
        every = 1 + len(starts) * len(self._points) * len(self._centres) // MOST_JUDGED
        starts = starts[::every]
        pixels, faces = self._predicted(starts)
        off = np.abs(pixels[:, :, None] - self._centres.pixels[None, None]).max(axis=3)
        off[~faces] = np.inf
        explained = (off.min(axis=1) < 2.0 * GATE_PX).sum(axis=1)
        order = np.argsort(-explained, kind="stable")[: 8 * CANDIDATES]
        found: Ints = every * order[explained[order] >= FEWEST]
        return found

    def _predicted(self, poses: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Pixels of all markers for poses (n, 3): (n, m, 2), and which of them face the camera (n, m)."""
        lens, (right, ahead) = self._camera.lens, (self._right, self._ahead)
        cosine, sine = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
        x = poses[:, 0, None] + cosine * self._points[:, 0] - sine * self._points[:, 1] - self._eye[0]
        y = poses[:, 1, None] + sine * self._points[:, 0] + cosine * self._points[:, 1] - self._eye[1]
        depth = np.maximum(x * ahead[0] + y * ahead[1], 1e-3)
        u = lens.cx_px + lens.f_px * (x * right[0] + y * right[1]) / depth
        v = lens.cy_px + lens.f_px * (self._eye[2] - self._points[:, 2]) / depth
        normal_x = cosine * self._normals[:, 0] - sine * self._normals[:, 1]
        normal_y = sine * self._normals[:, 0] + cosine * self._normals[:, 1]
        faces = -(normal_x * x + normal_y * y) > GRAZING * np.hypot(x, y)
        return np.stack((u, v), axis=2), faces & (depth > 0.1)

    def _matched(self, pose: Floats, gate_px: float) -> tuple[Ints, Ints]:
        """Markers and the spots that they explain, each used once, the nearest first."""
        pixels, faces = self._predicted(pose[None])
        off = np.linalg.norm(pixels[0][:, None] - self._centres.pixels[None], axis=2)
        off[~faces[0]] = np.inf
        markers: list[int] = []
        spots: list[int] = []
        while len(markers) < min(off.shape):
            marker, spot = np.unravel_index(int(np.argmin(off)), off.shape)
            if not off[marker, spot] < gate_px:
                break
            markers.append(int(marker))
            spots.append(int(spot))
            off[marker], off[:, spot] = np.inf, np.inf
        return np.array(markers, np.int64), np.array(spots, np.int64)

    def _fitted(self, start: Floats) -> _Fit | None:
        """The pose by Gauss and Newton, spots matched anew with each step; None if it explains too little."""
        pose = start.copy()
        for step in range(STEPS):
            markers, spots = self._matched(pose, GATE_PX if step < 2 else FINE_PX)
            if len(markers) < FEWEST:
                return None
            residuals, slopes = self._equations(pose, markers, spots)
            normal = slopes.T @ slopes
            if np.linalg.cond(normal) > 1e12:
                return None
            move = np.linalg.solve(normal, -slopes.T @ residuals)
            pose = pose + np.clip(move, -0.2, 0.2)
            if step > 2 and np.abs(move).max() < 1e-6:
                break
        markers, spots = self._matched(pose, FINE_PX)
        if len(markers) < FEWEST:
            return None
        residuals, slopes = self._equations(pose, markers, spots)
        covariance: Floats = np.asarray(np.linalg.inv(slopes.T @ slopes), dtype=np.float64)
        return _Fit(pose, covariance, float(residuals @ residuals), len(markers))

    def _equations(self, pose: Floats, markers: Ints, spots: Ints) -> tuple[Floats, Floats]:
        """Whitened residuals (2 m,) and their derivatives by x, y, heading (2 m, 3)."""
        lens, (right, ahead) = self._camera.lens, (self._right, self._ahead)
        points = self._points[markers]
        cosine, sine = np.cos(pose[2]), np.sin(pose[2])
        arm = np.column_stack((
            cosine * points[:, 0] - sine * points[:, 1], sine * points[:, 0] + cosine * points[:, 1]
        ))  # fmt: skip
        from_eye = arm + pose[:2] - self._eye[:2]
        depth, across = from_eye @ ahead, from_eye @ right
        above = self._eye[2] - points[:, 2]
        pixels = np.column_stack((across, above)) * (lens.f_px / depth)[:, None] + (lens.cx_px, lens.cy_px)
        pixels += self._askew(pose[2], markers, depth, across, above)
        moves = np.zeros((len(points), 2, 3))  # of the point by x, y, heading
        moves[:, 0, 0] = moves[:, 1, 1] = 1.0
        moves[:, 0, 2], moves[:, 1, 2] = -arm[:, 1], arm[:, 0]
        by_depth = np.einsum("i,nij->nj", ahead, moves)
        by_across = np.einsum("i,nij->nj", right, moves)
        scale = (lens.f_px / depth)[:, None]
        du = scale * (by_across - (across / depth)[:, None] * by_depth)
        dv = -scale * (above / depth)[:, None] * by_depth
        whiten = self._whiten[spots]
        residuals = np.einsum("nij,nj->ni", whiten, pixels - self._centres.pixels[spots])
        slopes = np.einsum("nij,njk->nik", whiten, np.stack((du, dv), axis=1))
        return residuals.ravel(), slopes.reshape(-1, 3)

    def _askew(
        self, heading_rad: float, markers: Ints, depth: Floats, across: Floats, above: Floats
    ) -> Floats:
        """How far the light of each marker lies from the image of its middle, px (m, 2).

        Along the tangent, which runs c across and q into the depth, with s from the middle, an element is
        seen at u(s) = f (X + s c) / (Z + s q). Its image is as large as Z^-3, so the nearer half weighs
        more, times the cosine between the line of sight P and the hull, whose normal n turns by s / R. To
        second order its light is as that of the point s = r^2 (t.P / (4 R n.P) - q / Z), since the mean of
        s^2 over a disk is r^2 / 4.
        """
        normals = self._normals[markers]
        cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
        turned = np.column_stack((
            cosine * normals[:, 0] - sine * normals[:, 1], sine * normals[:, 0] + cosine * normals[:, 1]
        ))  # fmt: skip
        tangents = np.column_stack((-turned[:, 1], turned[:, 0]))
        c, q = tangents @ self._right, tangents @ self._ahead
        facing = across * (turned @ self._right) + depth * (turned @ self._ahead)
        facing = np.minimum(facing, -GRAZING * np.hypot(across, depth))
        radius_m, wide_m = self._body.radius_m, self._body.marker_radius_m
        s = wide_m**2 * ((across * c + depth * q) / (4.0 * radius_m * facing) - q / depth)
        scale = s * self._camera.lens.f_px / depth
        return np.column_stack((scale * (c - q * across / depth), -scale * q * above / depth))


def pairs_of(count: int) -> tuple[Ints, Ints]:
    """Return two of so many, each pair once; of more than `MOST_PAIRS` every so many-th."""
    first, second = np.triu_indices(count, 1)
    every = 1 + len(first) // MOST_PAIRS
    return first[::every], second[::every]


def _is_near(one: Floats, other: Floats) -> bool:
    turn = (one[2] - other[2] + np.pi) % (2.0 * np.pi) - np.pi
    return bool(np.hypot(*(one[:2] - other[:2])) < OTHER_M and abs(turn) < OTHER_RAD)
