"""The compiled solver of poses beside the same steps in NumPy."""

import numpy as np
import pytest
from oracles import levenberg as oracle
from oracles import relative_scenes as scenes
from scipy.spatial.transform import Rotation

from groundstation.relative_navigation.levenberg import PosePrior, solve_levenberg
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pose import Pose, Sight

pytestmark = pytest.mark.core

CAMERA = PinholeCamera(scenes.F_PX, scenes.CX, scenes.CY, scenes.WIDTH, scenes.HEIGHT)


@pytest.mark.parametrize("kept", [6, 4, 2])
@pytest.mark.parametrize("is_weighed", [False, True])
@pytest.mark.parametrize("has_prior", [False, True])
def test_core_and_oracle_take_the_same_steps(rng, kept, is_weighed, has_prior):
    for _ in range(12):
        rotation = Rotation.from_rotvec(rng.uniform(-0.6, 0.6, 3))
        position = np.array([0.1, -0.2, rng.uniform(3.0, 15.0)])
        pixels = scenes.Scene().pixels(rotation, position)[:kept] + rng.normal(0.0, 0.3, (kept, 2))
        weights = np.linalg.cholesky(np.eye(2) + 0.2 * np.ones((kept, 2, 2))) if is_weighed else 1.0 / 0.3
        sight = Sight(np.arange(kept), pixels, weights)
        start = Pose((Rotation.from_rotvec(rng.normal(0, 0.1, 3)) * rotation).as_matrix(), 1.05 * position)
        prior = PosePrior(start, np.diag([1e2, 1e2, 1e1, 1e2, 1e2, 1e2])) if has_prior else None
        ours = solve_levenberg(CAMERA, scenes.CUBE, sight, start, prior)
        other = oracle.solve_levenberg(CAMERA, scenes.CUBE, sight, start, prior)
        assert ours.converged == other.converged
        if not other.converged:
            continue
        assert ours.iterations == other.iterations
        assert ours.pose.position_camera_m == pytest.approx(other.pose.position_camera_m, abs=1e-8)
        assert ours.pose.camera_from_body == pytest.approx(other.pose.camera_from_body, abs=1e-9)
        assert ours.covariance == pytest.approx(other.covariance, rel=1e-5, abs=1e-12)
        assert ours.cost == pytest.approx(other.cost, rel=1e-9)


def test_points_behind_the_camera_are_no_solution():
    sight = Sight(np.arange(6), np.zeros((6, 2)), 1.0)
    assert not solve_levenberg(CAMERA, scenes.CUBE, sight, Pose(np.eye(3), np.array([0, 0, -3.0]))).converged
