"""One candidate pose made a fix or refused: matched, refined with a shrinking gate, and put to the test."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import BodyMotion, Mode, PictureFix, PoseGuess, PosePrior
from groundstation.star_tracking.rays import CeilingPoints, CeilingRays, spot_covariance
from groundstation.star_tracking.sky_index import SkyIndex
from groundstation.star_tracking.tracker_settings import TrackerSettings
from oracles.evidence import Chance, evidence_nats
from oracles.motion import row_delays_s, smear_from_motion, to_middle_row, unbend
from oracles.refinement import Pose, refine
from oracles.sky_look_up import nearest

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]


@dataclass(slots=True)
class Sighting:
    """One picture being searched: its spots, what the search may still cost, and the best that it found.

    Attributes:
        spots: Of the picture.
        points: Where they are on the ceiling, body axes.
        motion: Velocity during the exposure, if known.
        look_ups_left: Spot positions that may still be tested.
        tested: Cells of the poses refined so far.
        best_nats: Best log likelihood over chance among these.
        best_guess: The pose that had it.
        is_ambiguous: Two places explain the picture.
    """

    spots: Spots
    points: CeilingPoints
    motion: BodyMotion | None
    look_ups_left: int
    tested: set[tuple[int, int, int]] = field(default_factory=set)
    best_nats: float = -math.inf
    best_guess: PoseGuess | None = None
    is_ambiguous: bool = False


class Settler:
    """Settles candidates under one sky.

    Args:
        sky: Tables over the catalogue.
        rays: Pixel to ceiling.
        settings: What to believe.
        is_dropped: Catalogue rows that no spot is matched to, and False for the star that is none,
            shape (stars + 1,); the owner may change it between pictures.
    """

    def __init__(
        self, sky: SkyIndex, rays: CeilingRays, settings: TrackerSettings, is_dropped: NDArray[np.bool_]
    ) -> None:
        self._sky, self._rays, self._settings, self._is_dropped = sky, rays, settings, is_dropped

    def settle(
        self, sighting: Sighting, turn: complex, shift: complex, gate_m: float, prior: PosePrior | None
    ) -> PictureFix | None:
        """Refine a candidate and put it to the test.

        Args:
            sighting: The picture; its best guess is kept up.
            turn: exp(i heading).
            shift: Body origin.
            gate_m: How far from their stars spots may be at first.
            prior: Where the candidate comes from, if not from the picture.
        """
        spots, points, tolerance_m = sighting.spots, sighting.points, self._sky.tolerance_m
        needed = self._settings.min_stars if prior is None else self._settings.min_stars_prior
        pose: Pose | None = None
        spot = star = np.zeros(0, np.int64)
        q = points.q_body_m
        for _ in range(3):
            q = self._at_middle(sighting, turn)
            spot, star = self._match(q, turn, shift, gate_m)
            if len(spot) < needed:
                return None
            covariance = self._covariance(spots, points, spot, star)
            pose = refine(q[spot], self._sky.position_m[star], covariance, turn, shift)
            turn, shift = pose.turn, pose.shift_m
            if gate_m <= 1.5 * tolerance_m:
                break
            gate_m = max(0.4 * gate_m, 1.2 * tolerance_m)
        assert pose is not None
        residual = turn * q[spot] + shift - self._sky.position_m[star]
        nats = self._evidence(q[spot], np.abs(residual), len(spots), prior, pose)
        if nats > sighting.best_nats:
            sighting.best_nats = nats
            sighting.best_guess = PoseGuess(shift.real, shift.imag, float(np.angle(turn)))
        if not nats >= self._settings.evidence_nats or int(pose.kept.sum()) < needed:
            return None
        kept = pose.kept
        return PictureFix(
            x_m=shift.real,
            y_m=shift.imag,
            heading_rad=float(np.angle(turn)),
            covariance=pose.covariance,
            stars=int(kept.sum()),
            mode=Mode.LOST_IN_SPACE if prior is None else Mode.TRACKING,
            spot_index=spot[kept],
            star_index=star[kept],
            residual_m=np.stack((residual[kept].real, residual[kept].imag), axis=1),
            evidence_nats=nats,
        )

    def _at_middle(self, sighting: Sighting, turn: complex) -> Complex:
        """Give the spots as at the middle of the middle row's exposure, the motion being known."""
        q, motion = sighting.points.q_body_m, sighting.motion
        if motion is None:
            return q
        if self._settings.exposure_s > 0.0:
            q = unbend(q, smear_from_motion(motion, self._settings.exposure_s, turn))
        if self._settings.readout_s > 0.0:
            delay = row_delays_s(sighting.spots.v_px, self._rays.camera.height, self._settings.readout_s)
            q = to_middle_row(q, delay, motion, turn)
        return q

    def _match(self, q: Complex, turn: complex, shift: complex, gate_m: float) -> tuple[Index, Index]:
        """Give (spot, star) within the gate; of two spots at one star the nearer one."""
        star, distance = nearest(self._sky, turn * q + shift)
        spot = np.flatnonzero((distance < gate_m) & ~self._is_dropped[star])
        if len(spot) == 0:
            return spot, spot
        order = spot[np.argsort(star[spot], kind="stable")]
        named = star[order]
        if (named[1:] == named[:-1]).any():
            spot = spot[np.argsort(distance[spot], kind="stable")]
            _, first = np.unique(star[spot], return_index=True)
            spot = np.sort(spot[first])
        return spot, star[spot].astype(np.int64)

    def _covariance(
        self, spots: Spots, points: CeilingPoints, spot: Index, star: Index
    ) -> NDArray[np.float64]:
        streak = spots.streak_px[spot]
        length2 = (streak * streak).sum(axis=1)
        variance_px2 = self._settings.centre_floor_px**2 + self._settings.streak_floor_ratio**2 * length2
        floor = variance_px2[:, None] * np.array([1.0, 0.0, 1.0])
        chosen = CeilingPoints(points.q_body_m[spot], points.jacobian_m_px[spot])
        covariance = spot_covariance(chosen, spots.covariance_px2[spot] + floor)
        variance = self._sky.variance_m2[star]
        covariance[:, 0, 0] += variance
        covariance[:, 1, 1] += variance
        return covariance

    def _evidence(
        self, q: Complex, distance: NDArray[np.float64], spots: int, prior: PosePrior | None, pose: Pose
    ) -> float:
        volume = 2.0 * math.pi * self._sky.area_m2
        if prior is not None:
            off = np.array(
                [
                    pose.shift_m.real - prior.x_table_m,
                    pose.shift_m.imag - prior.y_table_m,
                    float(np.angle(pose.turn * np.exp(-1j * prior.heading_rad))),
                ]
            )
            spread = prior.covariance + pose.covariance
            determinant = float(np.linalg.det(spread))
            if not determinant > 0.0:
                return -math.inf  # a prior that is none
            surprise = 0.5 * float(off @ np.linalg.solve(spread, off))
            volume = (2.0 * math.pi) ** 1.5 * math.sqrt(determinant) * math.exp(min(surprise, 200.0))
        lever = float(np.sqrt((np.abs(q - q.mean()) ** 2).sum()))
        return evidence_nats(
            distance,
            lever,
            spots,
            Chance(self._sky.density_m2, volume, self._rays.scale_m_px, self._settings.evidence_sigmas_px),
        )
