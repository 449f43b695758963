"""Lost-in-space and tracking star identification with a refined pose.

Lost in space: triangles of neighbouring spots are looked up among the catalogue's triangles; each hit
is a pose; all poses are tested at once on the raster of nearest stars; the best are refined and must
pass the likelihood test. Pictures with few spots go on with pairs. The work is capped, so a picture
that shows no ceiling costs a bounded time. With a prior, the stars near where it puts the spots are
matched directly, and lost-in-space is the fallback.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from calibration.camera.models import CameraCalibration
from calibration.camera.star_catalogue import StarCatalogue
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.evidence import SIGMAS_PX, Chance, evidence_nats
from groundstation.star_tracking.fixes import (
    BodyMotion,
    Mode,
    NoFix,
    PoseGuess,
    PosePrior,
    Refusal,
    StarFix,
)
from groundstation.star_tracking.hypotheses import (
    NEIGHBOUR_RANKS,
    Poses,
    pair_poses,
    spot_triangles,
    triangle_poses,
)
from groundstation.star_tracking.motion import (
    row_delays_s,
    smear_from_motion,
    smear_from_streaks,
    to_middle_row,
    unbend,
)
from groundstation.star_tracking.rays import CeilingPoints, CeilingRays
from groundstation.star_tracking.refinement import Pose, refine, spot_covariance
from groundstation.star_tracking.sky_index import SkyIndex

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]

_WHITE_DN = 245.0
_LONG_STREAK_PX = 12.0


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """How hard to try and what to believe.

    Attributes:
        tolerance_px: How far a triangle's lengths may be off, as pixels near the axis.
        centre_floor_px: Error of a centre that no fit knows of (PSF, survey), one sigma per axis.
        streak_floor_ratio: The same for streaks, per length: their true shape is not quite the fitted one.
        evidence_nats: Log likelihood over chance that a fix must have: e^-t bounds the false ones.
        evidence_sigmas_px: Errors of spots that the likelihood is averaged over.
        min_stars: Stars of a fix without a prior.
        min_stars_prior: Stars of a fix with a prior.
        identified_spots: The brightest so many spots take part in the search.
        pair_spots: The brightest so many take part in the search by pairs.
        pair_spots_total: With more spots than this pairs are not tried.
        look_ups: Cap on tested spot positions per picture.
        exposure_s: Of the camera; with a known motion it straightens streaks. 0: streaks tell themselves.
        readout_s: Time from the first to the last row of a rolling shutter; 0 for a global one.
    """

    tolerance_px: float = 1.4
    centre_floor_px: float = 0.012
    streak_floor_ratio: float = 0.002
    evidence_nats: float = 10.5
    evidence_sigmas_px: tuple[float, ...] = SIGMAS_PX
    min_stars: int = 4
    min_stars_prior: int = 3
    identified_spots: int = 60
    pair_spots: int = 12
    pair_spots_total: int = 20
    look_ups: int = 80_000
    exposure_s: float = 0.0
    readout_s: float = 0.0


@dataclass(slots=True)
class _Search:
    """One picture's search: what it may still cost, and the best that it found."""

    look_ups_left: int
    motion: BodyMotion | None = None
    best_nats: float = -math.inf
    best_guess: PoseGuess | None = None
    tested: set[tuple[int, int, int]] = field(default_factory=set)


class StarTracker:
    """Solves pictures of one ceiling through one camera.

    Args:
        catalogue: The stars.
        camera: The camera, its mount and the height of the ceiling.
        settings: How hard to try.
    """

    def __init__(
        self,
        catalogue: StarCatalogue,
        camera: CameraCalibration,
        settings: TrackerSettings | None = None,
    ) -> None:
        self.settings = settings or TrackerSettings()
        self.catalogue = catalogue
        self.rays = CeilingRays(camera)
        self._tolerance_m = self.settings.tolerance_px * self.rays.scale_m_px
        self._tolerance_m += 2.0 * float(np.median(catalogue.std_m))
        self.sky = SkyIndex(catalogue, self._tolerance_m, self.rays.reach_m)
        self._is_dropped = np.zeros(len(catalogue) + 1, dtype=bool)  # one more: the star that is none

    def drop(self, rows: Index) -> None:
        """Match no spot to these rows of the catalogue from now on, and to all others again."""
        self._is_dropped[:] = False
        self._is_dropped[rows] = True

    def solve(
        self, spots: Spots, prior: PosePrior | None = None, motion: BodyMotion | None = None
    ) -> StarFix | NoFix:
        """Give the pose at the exposure, or say why there is none.

        Args:
            spots: Light spots of one picture, brightest first.
            prior: What is believed of the pose; the fix does not contain it as information.
            motion: Velocity during the exposure, for cameras with a rolling shutter.
        """
        n = len(spots)
        if spots.is_flooded or spots.background_dn > _WHITE_DN:
            return NoFix(Refusal.FLOODED, "More of the picture is lit than a sky of stars can.", n)
        needed = self.settings.min_stars if prior is None else self.settings.min_stars_prior
        if n < needed:
            return self._too_few(spots, needed, motion)
        points = self.rays.look_up(spots.u_px, spots.v_px)
        if motion is None or self.settings.exposure_s == 0.0:
            smear = smear_from_streaks(points.q_body_m, spots.streak_px, points.jacobian_m_px)
            if smear is not None:
                points = CeilingPoints(unbend(points.q_body_m, smear), points.jacobian_m_px)
        search = _Search(self.settings.look_ups, motion)
        if prior is not None:
            fix = self._track(spots, points, prior, search)
            if fix is not None or n < self.settings.min_stars:
                return fix or self._refusal(spots, search)
        return self._lost_in_space(spots, points, search) or self._refusal(spots, search)

    def _lost_in_space(self, spots: Spots, points: CeilingPoints, search: _Search) -> StarFix | None:
        q = points.q_body_m[: self.settings.identified_spots]
        if len(q) > self.settings.min_stars:
            for ranks in (NEIGHBOUR_RANKS[:2], NEIGHBOUR_RANKS[2:6], NEIGHBOUR_RANKS[6:]):
                poses = triangle_poses(self.sky, q, spot_triangles(q, ranks))
                fix = self._best(spots, points, q, poses, search)
                if fix is not None:
                    return fix
        if len(q) > self.settings.pair_spots_total:
            return None  # triangles fail on many spots only if they are no stars
        q = q[: self.settings.pair_spots]
        first, second = np.triu_indices(len(q), k=1)
        length = np.abs(q[first] - q[second])
        usable = length < self.sky.pair_length_m[-1]
        order = np.argsort(first + second, kind="stable")  # bright with bright first
        for pair in order[usable[order]]:
            if search.look_ups_left <= 0:
                break
            poses = pair_poses(self.sky, q, int(first[pair]), int(second[pair]))
            fix = self._best(spots, points, q, poses, search)
            if fix is not None:
                return fix
        return None

    def _best(
        self, spots: Spots, points: CeilingPoints, q: Complex, poses: Poses, search: _Search
    ) -> StarFix | None:
        """Test all poses, refine the few that most spots agree with."""
        room = max(search.look_ups_left // max(len(q), 1), 0)
        turn, shift = poses.turn[:room], poses.shift_m[:room]
        if len(turn) == 0:
            return None
        search.look_ups_left -= len(turn) * len(q)
        _, distance = self.sky.nearest(turn[:, None] * q + shift[:, None])
        votes = np.count_nonzero(distance < 2.0 * self._tolerance_m, axis=1)
        for candidate in np.argsort(-votes, kind="stable")[:4]:
            if votes[candidate] < self.settings.min_stars:
                break
            cell = (
                round(shift[candidate].real / 0.05),
                round(shift[candidate].imag / 0.05),
                round(float(np.angle(turn[candidate])) / 0.02),
            )
            if cell in search.tested:
                continue
            search.tested.add(cell)
            fix = self._settle(spots, points, turn[candidate], shift[candidate], None, search)
            if fix is not None:
                return fix
        return None

    def _track(
        self, spots: Spots, points: CeilingPoints, prior: PosePrior, search: _Search
    ) -> StarFix | None:
        turn, shift = np.exp(1j * prior.heading_rad), complex(prior.x_table_m, prior.y_table_m)
        sigma = math.sqrt(max(prior.cov[0, 0], prior.cov[1, 1]))
        sigma = math.hypot(sigma, 0.5 * self.rays.reach_m * math.sqrt(prior.cov[2, 2]))
        gate = min(3.0 * sigma + 2.0 * self._tolerance_m, 0.1)
        matched = self._match(self._at_middle(spots, points, turn, search), turn, shift, gate)
        if len(matched[0]) < self.settings.min_stars_prior:
            return None
        return self._settle(spots, points, turn, shift, prior, search, gate)

    def _at_middle(self, spots: Spots, points: CeilingPoints, turn: complex, search: _Search) -> Complex:
        """Give the spots as at the middle of the middle row's exposure, the motion being known."""
        q, motion = points.q_body_m, search.motion
        if motion is None:
            return q
        if self.settings.exposure_s > 0.0:
            q = unbend(q, smear_from_motion(motion, self.settings.exposure_s, turn))
        if self.settings.readout_s > 0.0:
            delay = row_delays_s(spots.v_px, self.rays.camera.height, self.settings.readout_s)
            q = to_middle_row(q, delay, motion, turn)
        return q

    def _match(self, q: Complex, turn: complex, shift: complex, gate_m: float) -> tuple[Index, Index]:
        """Give (spot, star) within the gate; of two spots at one star the nearer one."""
        star, distance = self.sky.nearest(turn * q + shift)
        spot = np.flatnonzero((distance < gate_m) & ~self._is_dropped[star])
        if len(spot) == 0:
            return spot, spot
        order = spot[np.argsort(star[spot], kind="stable")]
        named = star[order]
        if (named[1:] == named[:-1]).any():
            spot = spot[np.argsort(distance[spot], kind="stable")]
            _, first = np.unique(star[spot], return_index=True)
            spot = np.sort(spot[first])
        return spot, star[spot]

    def _settle(
        self,
        spots: Spots,
        points: CeilingPoints,
        turn: complex,
        shift: complex,
        prior: PosePrior | None,
        search: _Search,
        gate_m: float | None = None,
    ) -> StarFix | None:
        """Refine one candidate with a shrinking gate and put it to the test."""
        gate = gate_m or 2.5 * self._tolerance_m
        needed = self.settings.min_stars if prior is None else self.settings.min_stars_prior
        pose: Pose | None = None
        spot = star = np.zeros(0, np.int64)
        q = points.q_body_m
        for _ in range(3):
            q = self._at_middle(spots, points, turn, search)
            spot, star = self._match(q, turn, shift, gate)
            if len(spot) < needed:
                return None
            cov = self._covariance(spots, points, spot, star)
            pose = refine(q[spot], self.sky.position_m[star], cov, turn, shift)
            turn, shift = pose.turn, pose.shift_m
            if gate <= 1.5 * self._tolerance_m:
                break
            gate = max(0.4 * gate, 1.2 * self._tolerance_m)
        assert pose is not None
        residual = turn * q[spot] + shift - self.sky.position_m[star]
        nats = self._evidence(q[spot], np.abs(residual), len(spots), prior, pose)
        if nats > search.best_nats:
            search.best_nats = nats
            search.best_guess = PoseGuess(shift.real, shift.imag, float(np.angle(turn)))
        if nats < self.settings.evidence_nats or int(pose.kept.sum()) < needed:
            return None
        kept = pose.kept
        return StarFix(
            x_m=shift.real,
            y_m=shift.imag,
            heading_rad=float(np.angle(turn)),
            cov=pose.cov,
            stars=int(kept.sum()),
            mode=Mode.LOST_IN_SPACE if prior is None else Mode.TRACKING,
            spot_index=spot[kept],
            star_index=star[kept],
            residual_m=np.stack((residual[kept].real, residual[kept].imag), axis=1),
            evidence_nats=nats,
        )

    def _covariance(
        self, spots: Spots, points: CeilingPoints, spot: Index, star: Index
    ) -> NDArray[np.float64]:
        streak = spots.streak_px[spot]
        length2 = (streak * streak).sum(axis=1)
        variance_px2 = self.settings.centre_floor_px**2 + self.settings.streak_floor_ratio**2 * length2
        floor = variance_px2[:, None] * np.array([1.0, 0.0, 1.0])
        chosen = CeilingPoints(points.q_body_m[spot], points.jacobian_m_px[spot])
        cov = spot_covariance(chosen, spots.cov_px2[spot] + floor)
        variance = self.sky.variance_m2[star]
        cov[:, 0, 0] += variance
        cov[:, 1, 1] += variance
        return cov

    def _evidence(
        self, q: Complex, distance: NDArray[np.float64], spots: int, prior: PosePrior | None, pose: Pose
    ) -> float:
        volume = 2.0 * math.pi * self.sky.area_m2
        if prior is not None:
            off = np.array(
                [
                    pose.shift_m.real - prior.x_table_m,
                    pose.shift_m.imag - prior.y_table_m,
                    float(np.angle(pose.turn * np.exp(-1j * prior.heading_rad))),
                ]
            )
            spread = prior.cov + pose.cov
            surprise = 0.5 * float(off @ np.linalg.solve(spread, off))
            gaussian = (2.0 * math.pi) ** 1.5 * math.sqrt(float(np.linalg.det(spread)))
            volume = gaussian * math.exp(min(surprise, 200.0))
        lever = float(np.sqrt((np.abs(q - q.mean()) ** 2).sum()))
        return evidence_nats(
            distance,
            lever,
            spots,
            Chance(self.sky.density_m2, volume, self.rays.scale_m_px, self.settings.evidence_sigmas_px),
        )

    def _too_few(self, spots: Spots, needed: int, motion: BodyMotion | None) -> NoFix:
        """Say why there are not even enough spots to begin with: no light, or light drawn out too thin."""
        n = len(spots)
        if _are_streaks(spots):
            return NoFix(Refusal.BLURRED, f"{n} spots, most of them streaks.", n)
        if motion is not None and self.settings.exposure_s > 0.0:
            path_m = math.hypot(motion.vx_table_m_s, motion.vy_table_m_s)
            path_m += 0.5 * self.rays.reach_m * abs(motion.omega_rad_s)
            streak_px = path_m * self.settings.exposure_s / self.rays.scale_m_px
            if streak_px > _LONG_STREAK_PX:
                return NoFix(Refusal.BLURRED, f"{n} spots; stars are streaks of {streak_px:.0f} px.", n)
        if n == 0:
            return NoFix(Refusal.NO_SPOTS, "No spot stands out of the noise.", 0)
        return NoFix(Refusal.TOO_FEW_STARS, f"{n} spots, a fix needs {needed}.", n)

    def _refusal(self, spots: Spots, search: _Search) -> NoFix:
        n = len(spots)
        guess = None
        if _are_streaks(spots):
            length = np.hypot(spots.streak_px[:, 0], spots.streak_px[:, 1])
            reason = Refusal.BLURRED
            detail = f"{n} spots, most of them streaks of {float(np.median(length)):.0f} px."
        elif math.isfinite(search.best_nats) and search.best_nats > 0.0:
            reason, detail = Refusal.NO_CONSENSUS, "A pose explains some spots, but chance could as well."
            guess = search.best_guess
        elif n < 2 * self.settings.min_stars:
            reason, detail = Refusal.TOO_FEW_STARS, f"{n} spots fit no place of the catalogue for certain."
        else:
            reason, detail = Refusal.NOT_OUR_CEILING, f"{n} spots fit no place of the catalogue."
        return NoFix(reason, detail, n, search.best_nats, guess)


def _are_streaks(spots: Spots) -> bool:
    length = np.hypot(spots.streak_px[:, 0], spots.streak_px[:, 1])
    return bool(np.count_nonzero(length > _LONG_STREAK_PX) > 0.5 * len(spots))
