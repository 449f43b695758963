"""From spots to a pose in NumPy: what the core's search must agree with, step by step."""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import BodyMotion, PictureFix, PosePrior
from groundstation.star_tracking.rays import CeilingPoints, CeilingRays
from groundstation.star_tracking.search import Found
from groundstation.star_tracking.sky_index import SkyIndex
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker
from groundstation.star_tracking.tracker_settings import NEIGHBOUR_RANKS, RANK_GROUPS, TrackerSettings
from oracles.hypotheses import Poses, pair_poses, spot_triangles, triangle_poses
from oracles.motion import smear_from_streaks, unbend
from oracles.settling import Settler, Sighting
from oracles.sky_look_up import nearest

Complex = NDArray[np.complex128]

_REFINED = 4  # of the poses of one look-up
_RIVALS = 16  # so many are looked at for another place that would do as well
_RIVAL_VOTES_RATIO = 0.8  # of the votes of the fix: with fewer a place is no rival
_SAME_RAD = 0.03
_TRIED_M, _TRIED_RAD = 0.05, 0.02  # poses nearer to each other than about this would refine to the same one


class OracleSearch:
    """The search in NumPy.

    Args:
        sky: Tables over the catalogue.
        rays: Pixel to ceiling.
        settings: How hard to try.
        is_dropped: Catalogue rows that no spot is matched to, and False for the star that is none,
            shape (stars + 1,); the owner may change it between pictures.
    """

    def __init__(
        self, sky: SkyIndex, rays: CeilingRays, settings: TrackerSettings, is_dropped: NDArray[np.bool_]
    ) -> None:
        self._sky, self._rays, self._settings = sky, rays, settings
        self._settler = Settler(sky, rays, settings, is_dropped)

    def find(self, spots: Spots, prior: PosePrior | None, motion: BodyMotion | None) -> Found:
        """Search one picture.

        Args:
            spots: Brightest first; enough of them for a fix with, or without, a prior.
            prior: What is believed of the pose.
            motion: Velocity during the exposure.
        """
        points = self._rays.look_up(spots.u_px, spots.v_px)
        if motion is None or self._settings.exposure_s == 0.0:
            smear = smear_from_streaks(points.q_body_m, spots.streak_px, points.jacobian_m_px)
            if smear is not None:
                points = CeilingPoints(unbend(points.q_body_m, smear), points.jacobian_m_px)
        sighting = Sighting(spots, points, motion, self._settings.look_ups)
        fix = None if prior is None else self._track(sighting, prior)
        if fix is None and len(spots) >= self._settings.min_stars:
            fix = self._lost_in_space(sighting)
        return Found(fix, sighting.best_nats, sighting.best_guess, sighting.is_ambiguous)

    def _track(self, sighting: Sighting, prior: PosePrior) -> PictureFix | None:
        turn, shift = np.exp(1j * prior.heading_rad), complex(prior.x_table_m, prior.y_table_m)
        sigma = math.sqrt(max(prior.covariance[0, 0], prior.covariance[1, 1]))
        sigma = math.hypot(sigma, 0.5 * self._rays.reach_m * math.sqrt(prior.covariance[2, 2]))
        gate = min(3.0 * sigma + 2.0 * self._sky.tolerance_m, 0.1)
        return self._settler.settle(sighting, turn, shift, gate, prior)

    def _lost_in_space(self, sighting: Sighting) -> PictureFix | None:
        q = sighting.points.q_body_m[: self._settings.identified_spots]
        if len(q) > self._settings.min_stars:
            for begin, end in pairwise((0, *RANK_GROUPS)):
                poses = triangle_poses(self._sky, q, spot_triangles(q, NEIGHBOUR_RANKS[begin:end]))
                fix = self._best(sighting, q, poses)
                if fix is not None:
                    return fix
        if len(q) > self._settings.pair_spots_total or len(self._sky.pairs) == 0:
            return None  # triangles fail on many spots only if they are no stars
        q = q[: self._settings.pair_spots]
        first, second = np.triu_indices(len(q), k=1)
        usable = np.abs(q[first] - q[second]) < self._sky.pair_length_m[-1]
        order = np.argsort(first + second, kind="stable")  # bright with bright first
        for pair in order[usable[order]]:
            if sighting.look_ups_left <= 0:
                break
            poses = pair_poses(self._sky, q, int(first[pair]), int(second[pair]))
            fix = self._best(sighting, q, poses)
            if fix is not None:
                return fix
        return None

    def _best(self, sighting: Sighting, q: Complex, poses: Poses) -> PictureFix | None:
        """Test all poses, settle the few that most spots agree with, and look for rivals of a fix.

        A ceiling that repeats itself (LEDs in rows and columns) explains a picture in many places: of
        such fixes the best one is believed only if it stands out.
        """
        room = max(sighting.look_ups_left // max(len(q), 1), 0)
        turn, shift = poses.turn[:room], poses.shift_m[:room]
        if len(turn) == 0:
            return None
        sighting.look_ups_left -= len(turn) * len(q)
        _, distance = nearest(self._sky, turn[:, None] * q + shift[:, None])
        votes = np.count_nonzero(distance < 2.0 * self._sky.tolerance_m, axis=1)
        fix: PictureFix | None = None
        needed, rival_nats = float(self._settings.min_stars), -math.inf
        for rank, candidate in enumerate(np.argsort(-votes, kind="stable")[:_RIVALS]):
            if votes[candidate] < needed or (fix is None and rank >= _REFINED):
                break
            if fix is not None and self._is_same(q, turn[candidate], shift[candidate], fix):
                continue
            if len(sighting.tested) >= self._settings.candidates:
                sighting.look_ups_left = 0
                break
            cell = (
                round(shift[candidate].real / _TRIED_M),
                round(shift[candidate].imag / _TRIED_M),
                round(float(np.angle(turn[candidate])) / _TRIED_RAD),
            )
            if cell in sighting.tested:
                continue
            sighting.tested.add(cell)
            gate = 2.5 * self._sky.tolerance_m
            found = self._settler.settle(sighting, turn[candidate], shift[candidate], gate, None)
            if found is None:
                continue
            if fix is None:
                fix, needed = found, max(needed, _RIVAL_VOTES_RATIO * votes[candidate])
            elif not self._is_same(q, np.exp(1j * found.heading_rad), complex(found.x_m, found.y_m), fix):
                rival_nats = max(rival_nats, min(fix.evidence_nats, found.evidence_nats))
                fix = max(fix, found, key=lambda one: one.evidence_nats)
        if fix is not None and not fix.evidence_nats - rival_nats >= self._settings.rival_nats:
            sighting.is_ambiguous = True
            sighting.look_ups_left = 0
            return None
        return fix

    def _is_same(self, q: Complex, turn: complex, shift: complex, fix: PictureFix) -> bool:
        """Whether a pose puts the spots about where a fix does: their middle, and the heading."""
        fix_turn, middle = np.exp(1j * fix.heading_rad), q.mean()
        off = abs((turn - fix_turn) * middle + shift - complex(fix.x_m, fix.y_m))
        return bool(off < 4.0 * self._sky.tolerance_m and abs(turn - fix_turn) < _SAME_RAD)


def oracle_tracker(
    catalogue: StarCatalogue, camera: CameraCalibration, settings: TrackerSettings | None = None
) -> StarTracker:
    """A star tracker that searches by this file."""
    tracker = StarTracker(catalogue, camera, settings)
    parts = (tracker.sky, tracker.rays, tracker.settings, tracker._is_dropped)
    tracker._search = OracleSearch(*parts)
    return tracker
