"""The published star identification, kept runnable as it is published, for comparison.

As published: stars of the catalogue and centres of the picture are triangulated (Delaunay, all triangles);
a triangle of the picture is compared with every one of the catalogue and matches where both its smallest and
its largest interior angle differ by less than a limit; each match gives the affine map from pixels to the
table that fits its vertices by least squares; each map places the centre of the picture; of the sorted places
the longest run of mutually close ones, two at least, gives its mean as the answer; otherwise there is none.

Not published, so assumed: the two limits; vertices are paired by angle; close means both coordinates within
the limit, for each pair of the run; the heading is the mean turn of the run's maps; the pose of the body
follows by the camera's known mount. With three vertices the least squares fits exactly; mirrored maps count.

What `PublishedSettings` calls an addition is ours.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import QhullError, cKDTree

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.close_run import longest_run
from groundstation.star_tracking.delaunay import triangles_of
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import BodyMotion, Mode, NoFix, PictureFix, PosePrior, Refusal
from groundstation.star_tracking.published_settings import AS_PUBLISHED, PublishedSettings
from groundstation.star_tracking.rays import ceiling_points
from groundstation.star_tracking.star_catalogue import StarCatalogue

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LEAST_RUN = 2
"""Published: places that must be close to each other."""
LEAST_SPOTS = 3
SIMILARITY_RATIO = 1.1
"""Of the singular values of a map that still counts as a similarity; an addition."""
THIN_RAD = float(np.deg2rad(150.0))
"""Largest angle of a triangle that counts as thin; an addition."""
_MOST_MATCHES = 20_000
"""Bounds the time that a picture of thousands of lights takes; an addition that no ceiling comes near."""


class PublishedTracker:
    """Solves pictures by the published method.

    Args:
        catalogue: The stars.
        camera: Only its mount is used, to carry the centre of the picture to the body origin.
        settings: Limits and additions.

    Raises:
        ValueError: The catalogue has fewer than three stars, or all on one line.
    """

    def __init__(
        self,
        catalogue: StarCatalogue,
        camera: CameraCalibration,
        settings: PublishedSettings = AS_PUBLISHED,
    ) -> None:
        self._settings = settings
        self._star_m = np.stack((catalogue.x_m, catalogue.y_m), axis=1)
        try:
            self._triangles, self._angles = self._triangulate(self._star_m)
        except QhullError as error:
            raise ValueError("the catalogue has no triangle: three stars off one line are needed") from error
        self._tree = cKDTree(self._angles) if settings.uses_tree else None
        self._centre_px = np.array([0.5 * (camera.width - 1), 0.5 * (camera.height - 1)])
        q, jacobian = ceiling_points(camera, self._centre_px[:1], self._centre_px[1:])
        self._q_centre_m = complex(q[0, 0], q[0, 1])
        # Image axes turned against the body's by the mount, as seen on the ceiling.
        self._image_turn_rad = float(np.angle(complex(jacobian[0, 0, 0], jacobian[0, 1, 0])))

    @property
    def triangles(self) -> int:
        """How many triangles the catalogue has."""
        return len(self._triangles)

    def solve(
        self, spots: Spots, prior: PosePrior | None = None, motion: BodyMotion | None = None
    ) -> PictureFix | NoFix:
        """Give the pose at the exposure, or say why there is none.

        Args:
            spots: Of one picture.
            prior: Not used: the method is lost in space.
            motion: Not used.
        """
        del prior, motion
        n = len(spots)
        if n < LEAST_SPOTS:
            return NoFix(Refusal.TOO_FEW_STARS, f"{n} spots, a triangle needs {LEAST_SPOTS}.", n)
        spot_px = np.stack((spots.u_px, spots.v_px), axis=1)
        try:
            triangles, angles = self._triangulate(spot_px)
        except QhullError:
            return NoFix(Refusal.TOO_FEW_STARS, "The spots lie on one line.", n)
        seen, known = self._matches(angles)
        if len(seen) == 0:
            return NoFix(Refusal.NO_CONSENSUS, "No triangle resembles one of the catalogue.", n)
        spot, star = triangles[seen], self._triangles[known]
        matrix, shift = affine_maps(spot_px[spot], self._star_m[star])
        if self._settings.only_similar:
            similar = is_similarity(matrix)
            matrix, shift, spot, star = matrix[similar], shift[similar], spot[similar], star[similar]
        place = matrix @ self._centre_px + shift
        run = longest_run(place, self._settings.closeness_m)
        if len(run) < LEAST_RUN:
            return NoFix(Refusal.NO_CONSENSUS, f"No two of {len(place)} places are close to each other.", n)
        return self._fix(matrix[run], place[run], spot[run].ravel(), star[run].ravel())

    def _triangulate(self, points: Array) -> tuple[Indices, Array]:
        triangles, angles = triangles_of(points)
        if self._settings.drops_thin:
            fat = angles[:, 1] < THIN_RAD
            return triangles[fat], angles[fat]
        return triangles, angles

    def _matches(self, angles: Array) -> tuple[Indices, Indices]:
        """Give pairs of a triangle of the picture and one of the catalogue whose angles agree."""
        limit = self._settings.angle_limit_rad
        if self._tree is None:
            seen, known = alike(angles, self._angles, limit)
        else:
            found = self._tree.query_ball_point(
                angles, np.nextafter(limit, 0.0), p=np.inf, return_sorted=True
            )
            lists = [np.asarray(each, dtype=np.int64) for each in np.asarray(found, dtype=object)]
            seen = np.repeat(np.arange(len(angles)), [len(each) for each in lists])
            known = np.concatenate([np.zeros(0, np.int64), *lists])
        return seen[:_MOST_MATCHES].astype(np.int64), known[:_MOST_MATCHES].astype(np.int64)

    def _fix(self, matrix: Array, place: Array, spot: Indices, star: Indices) -> PictureFix:
        turns = (matrix[:, 0, 0] + matrix[:, 1, 1]) + 1j * (matrix[:, 1, 0] - matrix[:, 0, 1])
        turns = turns / np.maximum(np.abs(turns), np.finfo(float).tiny)
        middle = complex(np.sum(turns))
        offsets = np.angle(turns * np.conj(middle))
        where, turned = place.mean(axis=0), float(np.angle(middle))
        if self._settings.takes_median:
            where, turned = np.median(place, axis=0), turned + float(np.median(offsets))
        turn = np.exp(1j * (turned - self._image_turn_rad))
        origin = complex(where[0], where[1]) - turn * self._q_centre_m
        star, first = np.unique(star, return_index=True)
        return PictureFix(
            x_m=float(origin.real),
            y_m=float(origin.imag),
            heading_rad=float(np.angle(turn)),
            covariance=self._covariance(place, offsets, len(star)),
            stars=len(star),
            mode=Mode.PUBLISHED,
            spot_index=spot[first],
            star_index=star,
            residual_m=np.zeros((len(star), 2)),
            evidence_nats=float("nan"),
        )

    def _covariance(self, place: Array, offsets_rad: Array, stars: int) -> Array:
        """Guess what the publication does not give, from the scatter of the run.

        Maps that share stars err alike: their scatter is divided by the stars' number; that of a few maps
        tells little, so it is mixed with what the method lets pass.
        """
        maps = len(place)
        mixed = (maps - 1 + LEAST_RUN) * stars
        passed_m2 = (0.25 * self._settings.closeness_m) ** 2
        passed_rad2 = (0.5 * self._settings.angle_limit_rad) ** 2
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = ((maps - 1) * np.cov(place.T) + LEAST_RUN * passed_m2 * np.eye(2)) / mixed
        covariance[2, 2] = float(offsets_rad @ offsets_rad + LEAST_RUN * passed_rad2) / mixed
        return covariance


def alike(angles: Array, known: Array, limit_rad: float) -> tuple[Indices, Indices]:
    """Compare each triangle with every known one, by (smallest, largest) interior angle.

    Args:
        angles: Of the picture's triangles, shape (n, 2), rad.
        known: Of the catalogue's, shape (m, 2), rad.
        limit_rad: Both angles must differ by less.

    Returns:
        Rows of both, a pair for each match.
    """
    seen, found = np.nonzero((np.abs(angles[:, None] - known[None]) < limit_rad).all(axis=2))
    return seen, found


def affine_maps(spot_px: Array, star_m: Array) -> tuple[Array, Array]:
    """Give the affine maps star = matrix spot + shift that fit vertices best, by least squares.

    Args:
        spot_px: Vertices in the picture, shape (t, k, 2), k of three or more.
        star_m: The same on the table, shape (t, k, 2).

    Returns:
        Matrices (t, 2, 2) and shifts (t, 2).
    """
    design = np.concatenate((spot_px, np.ones((*spot_px.shape[:2], 1))), axis=2)
    solved = np.linalg.pinv(design) @ star_m  # rows: what u, v and 1 contribute to x, y
    return np.ascontiguousarray(solved[:, :2].transpose(0, 2, 1)), np.ascontiguousarray(solved[:, 2])


def is_similarity(matrix: Array) -> NDArray[np.bool_]:
    """Tell maps without mirror and with nearly equal singular values."""
    determinant = matrix[:, 0, 0] * matrix[:, 1, 1] - matrix[:, 0, 1] * matrix[:, 1, 0]
    norm2 = (matrix**2).sum(axis=(1, 2))
    # For singular values s1 >= s2: norm2 / det = s1/s2 + s2/s1.
    limit = SIMILARITY_RATIO + 1.0 / SIMILARITY_RATIO
    similar: NDArray[np.bool_] = (determinant > 0.0) & (norm2 <= limit * determinant)
    return similar
