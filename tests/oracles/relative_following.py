"""A tracker fed from a scene, and its errors."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from groundstation.data_sets.relative_case import case_of
from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.motion_models import DEFAULT, MOTION_MODELS
from groundstation.relative_navigation.solvers import SOLVERS
from groundstation.relative_navigation.tracker_settings import Frame
from oracles import relative_scenes as scenes


@dataclass
class Followed:
    """Answers and errors (n, 6) of a scene, bounds (n, 6, 6) of its single frames."""

    tracks: list
    errors: np.ndarray
    bounds: np.ndarray
    rate_errors: np.ndarray

    @property
    def statuses(self):
        return [track.status.value for track in self.tracks]

    @property
    def solved(self):
        return np.array([status == "solved" for status in self.statuses])

    def ratio(self, part):
        """Rms error over the bound of single frames, of positions or turns."""
        cut = slice(0, 3) if part == "position" else slice(3, 6)
        rms = np.mean(np.sum(self.errors[:, cut] ** 2, axis=1))
        return float(np.sqrt(rms / np.mean([np.trace(bound[cut, cut]) for bound in self.bounds])))

    def squares(self):
        """Squared errors in sigmas of the answers' covariances."""
        pairs = zip(self.errors, self.tracks, strict=True)
        return np.array([e @ np.linalg.solve(track.covariance, e) for e, track in pairs])


def frames_of(rows, sigma_px, labelled):
    rows = np.array(rows)
    for number in range(int(rows[:, 0].max()) + 1):
        own = rows[rows[:, 0] == number]
        if len(own):
            covariances = np.broadcast_to(sigma_px**2 * np.eye(2), (len(own), 2, 2))
            points = own[:, 2].astype(np.int64) if labelled else None
            yield Frame(number, float(own[0, 1]), Centres(own[:, 3:5].copy(), covariances, points, sigma_px))


def follow(scene, motion, seed, model=DEFAULT, clutter=0.0, missing=0.0, labelled=True, guessed=True, **more):
    rng = np.random.default_rng(seed)
    rows = scenes.seen(scene, motion, rng, clutter, missing, labelled)
    if guessed:
        more["guess_frame0"] = scenes.guess(motion, rng)
    case = case_of(scene.case(labelled=labelled, **more))
    tracker = MOTION_MODELS[model](case.settings, SOLVERS["lm"]())
    found = Followed([], [], [], [])
    for frame in frames_of(rows, scene.sigma_px, labelled):
        track = tracker.look(frame)
        rotation, position = motion.rotations[frame.number], motion.positions_m[frame.number]
        found.tracks.append(track)
        found.bounds.append(scenes.bound(scene, rotation, position))
        found.rate_errors.append(track.rate_rad_s - motion.rates_rad_s[frame.number])
        if track.pose is None:
            found.errors.append(np.full(6, np.nan))
            continue
        turn = (Rotation.from_matrix(track.pose.camera_from_body) * rotation.inv()).as_rotvec()
        found.errors.append(np.r_[track.pose.position_camera_m - position, turn])
    found.errors, found.bounds = np.array(found.errors), np.array(found.bounds)
    found.rate_errors = np.array(found.rate_errors)
    return found
