"""The published star identification, kept runnable for comparison.

Spots and catalogue are triangulated (Delaunay); triangles whose smallest and largest interior angles
agree are matched vertex by vertex, which gives an affine map each; maps that are nearly similarities
place the centre of the picture on the ceiling; the largest cluster of these places is the answer and
its median the fix. No camera calibration enters the identification. Thin triangles are left out.

The triangulation costs O(n log n) and the look-up O(log n) per triangle by a KD-tree over the angles,
where the publication scanned the catalogue.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, QhullError, cKDTree

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import Mode, NoFix, PictureFix, Refusal
from groundstation.star_tracking.rays import ceiling_points
from groundstation.star_tracking.star_catalogue import StarCatalogue

Array = NDArray[np.float64]

ANGLE_TOLERANCE_RAD = np.deg2rad(1.2)
LARGEST_ANGLE_RAD = np.deg2rad(150.0)  # thinner triangles of the hull tell nothing
SIMILARITY_RATIO = 1.1  # of the singular values of a map that still counts as a similarity
CLUSTER_RADIUS_M = 0.05
MIN_CLUSTER = 3
_MAX_MATCHES = 20_000


class PublishedTracker:
    """Solves pictures by the published method.

    Args:
        catalogue: The stars.
        camera: Only its mount is used, to carry the centre of the picture to the body origin.
    """

    def __init__(self, catalogue: StarCatalogue, camera: CameraCalibration) -> None:
        self._star_m = np.stack((catalogue.x_m, catalogue.y_m), axis=1)
        self._triangles, angles = _triangulate(self._star_m)
        self._tree = cKDTree(angles)
        self._centre_px = np.array([[0.5 * (camera.width - 1), 0.5 * (camera.height - 1)]])
        q, jacobian = ceiling_points(camera, self._centre_px[:, 0], self._centre_px[:, 1])
        self._q_centre_m = complex(q[0, 0], q[0, 1])
        # Image axes turned against the body's by the mount, as seen on the ceiling.
        self._image_turn_rad = float(np.angle(complex(jacobian[0, 0, 0], jacobian[0, 1, 0])))

    def solve(self, spots: Spots) -> PictureFix | NoFix:
        """Give the pose at the exposure, or say why there is none."""
        n = len(spots)
        if n < MIN_CLUSTER + 1:
            return NoFix(Refusal.TOO_FEW_STARS, f"{n} spots, a triangulation needs {MIN_CLUSTER + 1}.", n)
        spot_px = np.stack((spots.u_px, spots.v_px), axis=1)
        try:
            triangles, angles = _triangulate(spot_px)
        except QhullError:
            return NoFix(Refusal.TOO_FEW_STARS, "The spots lie on one line.", n)
        found = self._lookalikes(angles)
        query = np.repeat(np.arange(len(angles)), [len(f) for f in found])[:_MAX_MATCHES]
        if len(query) == 0:
            return NoFix(Refusal.NO_CONSENSUS, "No triangle resembles one of the catalogue.", n)
        entry = np.concatenate([np.asarray(f, dtype=np.int64) for f in found])[:_MAX_MATCHES]
        spot, star = triangles[query], self._triangles[entry]
        matrix, shift = _affine_maps(spot_px[spot], self._star_m[star])
        similar = _is_similarity(matrix)
        matrix, shift, spot, star = matrix[similar], shift[similar], spot[similar], star[similar]
        centre = matrix @ self._centre_px[0] + shift
        member = _largest_cluster(centre)
        if len(member) < MIN_CLUSTER:
            return NoFix(
                Refusal.NO_CONSENSUS, f"The largest cluster has {len(member)} maps, not {MIN_CLUSTER}.", n
            )
        return self._fix(matrix[member], centre[member], spot[member].ravel(), star[member].ravel())

    def _lookalikes(self, angles: Array) -> list[list[int]]:
        """Give, for every triangle of spots, the catalogue's triangles of like angles."""
        if len(angles) == 0:
            return []
        found = self._tree.query_ball_point(angles, ANGLE_TOLERANCE_RAD, p=np.inf)
        return [list(each) for each in np.asarray(found, dtype=object)]

    def _fix(
        self, matrix: Array, centre: Array, spot: NDArray[np.int64], star: NDArray[np.int64]
    ) -> PictureFix:
        place = np.median(centre, axis=0)
        turns = (matrix[:, 0, 0] + matrix[:, 1, 1]) + 1j * (matrix[:, 1, 0] - matrix[:, 0, 1])
        middle = complex(np.sum(turns / np.abs(turns)))
        offsets = np.angle(turns * np.conj(middle))
        heading = float(np.angle(middle)) + float(np.median(offsets)) - self._image_turn_rad
        turn = np.exp(1j * heading)
        origin = complex(place[0], place[1]) - turn * self._q_centre_m
        # The publication gives no covariance. Maps that share stars err alike: their scatter is divided by
        # the stars' number; that of a few maps tells little, so it is mixed with what the method lets pass.
        maps, stars = len(centre), len(np.unique(star))
        mixed = (maps - 1 + MIN_CLUSTER) * stars
        passed_m2 = (0.25 * CLUSTER_RADIUS_M) ** 2
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = ((maps - 1) * np.cov(centre.T) + MIN_CLUSTER * passed_m2 * np.eye(2)) / mixed
        covariance[2, 2] = float(offsets @ offsets + MIN_CLUSTER * (0.5 * ANGLE_TOLERANCE_RAD) ** 2) / mixed
        star, first = np.unique(star, return_index=True)
        return PictureFix(
            x_m=float(origin.real),
            y_m=float(origin.imag),
            heading_rad=float(np.angle(turn)),
            covariance=covariance,
            stars=len(star),
            mode=Mode.PUBLISHED,
            spot_index=spot[first],
            star_index=star,
            residual_m=np.zeros((len(star), 2)),
            evidence_nats=float("nan"),
        )


def _triangulate(point: Array) -> tuple[NDArray[np.int64], Array]:
    """Give triangles (t, 3), vertices by rising interior angle, and (smallest, largest) angle (t, 2)."""
    triangles = Delaunay(point).simplices.astype(np.int64)
    corner = point[triangles]
    one = np.roll(corner, -1, axis=1) - corner
    two = np.roll(corner, 1, axis=1) - corner
    cross = one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
    angle = np.arctan2(np.abs(cross), (one * two).sum(axis=2))
    order = np.argsort(angle, axis=1)
    angle = np.take_along_axis(angle, order, axis=1)
    fat = angle[:, 2] < LARGEST_ANGLE_RAD
    return np.take_along_axis(triangles, order, axis=1)[fat], angle[fat][:, [0, 2]]


def _affine_maps(spot_px: Array, star_m: Array) -> tuple[Array, Array]:
    """Give the maps star = matrix spot + shift of triangles (t, 3, 2): (t, 2, 2) and (t, 2)."""
    spot_arms = (spot_px[:, 1:] - spot_px[:, :1]).transpose(0, 2, 1)
    star_arms = (star_m[:, 1:] - star_m[:, :1]).transpose(0, 2, 1)
    matrix = star_arms @ np.linalg.inv(spot_arms)
    shift = star_m[:, 0] - np.einsum("tij,tj->ti", matrix, spot_px[:, 0])
    return matrix, shift


def _is_similarity(matrix: Array) -> NDArray[np.bool_]:
    """Tell maps without mirror and with nearly equal singular values."""
    determinant = matrix[:, 0, 0] * matrix[:, 1, 1] - matrix[:, 0, 1] * matrix[:, 1, 0]
    norm2 = (matrix**2).sum(axis=(1, 2))
    # For singular values s1 >= s2: norm2 / det = s1/s2 + s2/s1.
    limit = SIMILARITY_RATIO + 1.0 / SIMILARITY_RATIO
    similar: NDArray[np.bool_] = (determinant > 0.0) & (norm2 <= limit * determinant)
    return similar


def _largest_cluster(centre_m: Array) -> NDArray[np.int64]:
    if len(centre_m) == 0:
        return np.zeros(0, np.int64)
    tree = cKDTree(centre_m)
    sizes = np.asarray(tree.query_ball_point(centre_m, CLUSTER_RADIUS_M, return_length=True))
    seed = int(np.argmax(sizes))
    return np.asarray(tree.query_ball_point(centre_m[seed], CLUSTER_RADIUS_M), dtype=np.int64)
