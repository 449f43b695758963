"""Projection and its derivatives, solvers, covariances and bounds, beside OpenCV, scipy and differences."""

import cv2
import numpy as np
import pytest
from oracles import relative_scenes as scenes
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from groundstation.relative_navigation.bounds import pose_bound
from groundstation.relative_navigation.levenberg import PosePrior, solve_levenberg
from groundstation.relative_navigation.newton import solve_newton
from groundstation.relative_navigation.pinhole import PinholeCamera, from_published
from groundstation.relative_navigation.pixel_equations import jacobian, predicted_pixels
from groundstation.relative_navigation.pose import Pose, Sight
from groundstation.relative_navigation.rotations import (
    angle_between,
    matrix_of,
    orthonormal,
    quaternion_of,
    rotation_vector,
    rotation_vectors,
    turn,
    turns,
)
from groundstation.relative_navigation.solvers import SOLVERS

CAMERA = PinholeCamera(scenes.F_PX, scenes.CX, scenes.CY, scenes.WIDTH, scenes.HEIGHT)
ALL = np.arange(6)


def random_pose(rng, distance):
    tilt = Rotation.from_rotvec(rng.uniform(-0.6, 0.6, 3))
    sideways = rng.uniform(-0.08, 0.08, 2) * distance
    return tilt, np.array([*sideways, distance])


def as_pose(rotation, position):
    return Pose(rotation.as_matrix(), np.asarray(position, dtype=float))


def test_rotations_agree_with_scipy_everywhere(rng):
    for size in (0.0, 1e-9, 1e-3, 1.0, 3.0, np.pi - 1e-7):
        axis = rng.normal(size=3)
        vector = size * axis / np.linalg.norm(axis)
        other = Rotation.from_rotvec(vector)
        assert turn(vector) == pytest.approx(other.as_matrix(), abs=1e-14)
        assert turns(vector[None])[0] == pytest.approx(other.as_matrix(), abs=1e-14)
        assert rotation_vector(turn(vector)) == pytest.approx(vector, abs=3e-8)
        assert rotation_vectors(turn(vector)[None])[0] == pytest.approx(vector, abs=3e-8)
        assert matrix_of(quaternion_of(turn(vector))) == pytest.approx(turn(vector), abs=1e-12)
        assert angle_between(turn(vector), np.eye(3)) == pytest.approx(size, abs=3e-8)
    loose = turn(np.array([0.3, -1.0, 0.2])) + 1e-6 * rng.normal(size=(3, 3))
    assert orthonormal(loose) @ orthonormal(loose).T == pytest.approx(np.eye(3), abs=1e-10)


def test_pixels_are_those_of_a_matrix_and_opencv(rng):
    scene = scenes.Scene()
    for distance in (2.0, 9.0, 15.0):
        rotation, position = random_pose(rng, distance)
        ours = predicted_pixels(CAMERA, scene.points_m, as_pose(rotation, position))
        assert ours == pytest.approx(scene.pixels(rotation, position), abs=1e-9)
        opencv, _ = cv2.projectPoints(
            scene.points_m, rotation.as_rotvec(), position, scene.matrix[:, :3], None
        )
        assert ours == pytest.approx(opencv[:, 0], abs=1e-9)


def test_the_jacobian_is_that_of_complex_steps(rng):
    """A complex step has no cancellation: the derivative is exact to rounding."""
    scene = scenes.Scene()
    rotation, position = random_pose(rng, 5.0)
    exact = np.empty((6, 2, 6))
    for k in range(6):
        step = np.zeros(6, complex)
        step[k] = 1e-200j
        x, y, z = step[3:]
        small = np.eye(3) + np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        points = scene.points_m @ (small @ rotation.as_matrix()).T + position + step[:3]
        exact[:, :, k] = (scene.f_px * points[:, :2] / points[:, 2:]).imag / 1e-200
    assert jacobian(CAMERA, scene.points_m, as_pose(rotation, position)) == pytest.approx(
        exact, rel=1e-12, abs=1e-10
    )


def test_the_published_camera_lies_a_focal_length_behind_its_sensor():
    f_m, point = -0.016, np.array([0.2, -0.1, 3.0])
    published = point[:2] / (1.0 - point[2] / f_m)  # x1 / (1 - x3 / f)
    ours = from_published(point, f_m)
    assert -f_m * ours[:2] / ours[2] == pytest.approx(published, rel=1e-12)
    with pytest.raises(ValueError, match="negative"):
        from_published(point, 0.016)


@pytest.mark.parametrize("name", [*SOLVERS])
def test_every_solver_finds_the_least_squares_of_scipy(rng, name):
    scene = scenes.Scene()
    for distance in (3.0, 9.0, 15.0):
        rotation, position = random_pose(rng, distance)
        pixels = scene.pixels(rotation, position) + rng.normal(0.0, 0.3, (6, 2))
        start = as_pose(Rotation.from_rotvec(rng.normal(0.0, 0.03, 3)) * rotation, 1.03 * position)
        fit = SOLVERS[name]()(CAMERA, scene.points_m, Sight(ALL, pixels, 1.0 / 0.3), start)

        def miss(x, pixels=pixels):
            return ((scene.pixels(Rotation.from_rotvec(x[3:]), x[:3]) - pixels) / 0.3).ravel()

        best = least_squares(miss, np.r_[position, rotation.as_rotvec()], xtol=1e-14, ftol=1e-14, gtol=1e-14)
        assert fit.converged
        share = 1e-3 if name != "differential-evolution" else 0.05  # of a sigma
        off = fit.pose.minus(as_pose(Rotation.from_rotvec(best.x[3:]), best.x[:3]))
        assert float(off @ np.linalg.solve(fit.covariance, off)) < share**2
        assert fit.cost == pytest.approx(2.0 * best.cost, rel=1e-3)


def test_errors_are_as_large_as_the_bound_and_as_the_covariance(rng):
    scene = scenes.Scene()
    for distance in (3.0, 15.0):
        rotation, position = random_pose(rng, distance)
        truth = as_pose(rotation, position)
        bound = scenes.bound(scene, rotation, position)
        assert pose_bound(CAMERA, scene.points_m, truth, 0.3) == pytest.approx(bound, rel=1e-5)
        off, squares = [], []
        for _ in range(400):
            pixels = scene.pixels(rotation, position) + rng.normal(0.0, 0.3, (6, 2))
            fit = solve_levenberg(CAMERA, scene.points_m, Sight(ALL, pixels, 1.0 / 0.3), truth)
            off.append(fit.pose.minus(truth))
            squares.append(off[-1] @ np.linalg.solve(fit.covariance, off[-1]))
        ratio = np.sqrt(np.mean(np.square(off), axis=0) / np.diag(bound))
        assert np.all(np.abs(ratio - 1.0) < 0.12)  # 400 draws: 3.5 % each, one sigma
        assert np.mean(squares) == pytest.approx(6.0, abs=0.6)


def test_centres_with_unlike_noise_are_weighed(rng):
    scene = scenes.Scene()
    rotation, position = random_pose(rng, 6.0)
    truth = as_pose(rotation, position)
    sigmas = np.array([0.05, 0.05, 0.05, 0.05, 0.05, 3.0])
    weights = np.eye(2) / sigmas[:, None, None]
    errors = {"weighed": [], "alike": []}
    for _ in range(60):
        pixels = scene.pixels(rotation, position) + rng.normal(size=(6, 2)) * sigmas[:, None]
        for name, each in (("weighed", weights), ("alike", 1.0)):
            fit = solve_levenberg(CAMERA, scene.points_m, Sight(ALL, pixels, each), truth)
            errors[name].append(np.linalg.norm(fit.pose.minus(truth)[3:]))
    assert np.mean(errors["weighed"]) < 0.3 * np.mean(errors["alike"])


def test_a_prior_and_a_frame_are_put_together_as_information_says(rng):
    scene = scenes.Scene()
    rotation, position = random_pose(rng, 10.0)
    truth = as_pose(rotation, position)
    prior = PosePrior(
        truth.moved(np.array([0.01, 0, 0.1, 0.01, -0.02, 0])), np.diag([1e4, 1e4, 1e2, 1e4, 1e4, 1e4])
    )
    pixels = scene.pixels(rotation, position)
    sight = Sight(ALL, pixels, 1.0 / 0.3)
    both = solve_levenberg(CAMERA, scene.points_m, sight, truth, prior)
    alone = solve_levenberg(CAMERA, scene.points_m, sight, truth)
    information = np.linalg.inv(alone.covariance) + prior.information
    assert np.linalg.inv(both.covariance) == pytest.approx(information, rel=0.05, abs=50.0)
    few = Sight(ALL[:2], pixels[:2], 1.0 / 0.3)
    assert solve_levenberg(CAMERA, scene.points_m, few, truth, prior).converged
    assert not solve_levenberg(CAMERA, scene.points_m, few, truth).converged


def test_newton_as_published_may_fail_where_levenberg_does_not(rng):
    """Six coplanar points far away: its matrix of second derivatives need not be positive."""
    scene = scenes.Scene(points_m=scenes.PLATE)
    worse = 0
    for _ in range(60):
        rotation, position = random_pose(rng, 15.0)
        pixels = scene.pixels(rotation, position) + rng.normal(0.0, 0.3, (6, 2))
        start = as_pose(Rotation.from_rotvec(rng.normal(0.0, 0.1, 3)) * rotation, position)
        sight = Sight(ALL, pixels, 1.0 / 0.3)
        ours = solve_levenberg(CAMERA, scene.points_m, sight, start)
        assert ours.converged
        published = solve_newton(CAMERA, scene.points_m, sight, start)
        worse += not published.converged or published.cost > ours.cost + 1.0
    assert 0 < worse < 40


def test_what_lies_behind_the_camera_is_no_solution():
    pixels = scenes.Scene().pixels(Rotation.identity(), [0, 0, 3.0])
    behind = Pose(np.eye(3), np.array([0, 0, -3.0]))
    for make in SOLVERS.values():
        fit = make()(CAMERA, scenes.CUBE, Sight(ALL, pixels, 1.0), behind)
        assert not fit.converged or fit.pose.position_camera_m[2] > 0.0
