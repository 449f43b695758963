"""Mock-ups found from above by their coloured circles."""

import cv2
import numpy as np
import pytest

from groundstation.star_tracking.overhead import Circle, Livery, OverheadCamera, find_mock_ups

DISTORTION = (-0.08, 0.03, 0.0005, -0.0004, 0.0)
TILT = cv2.Rodrigues(np.array([0.02, -0.03, 0.0]))[0]
CAMERA = OverheadCamera(
    700.0,
    702.0,
    318.0,
    243.0,
    DISTORTION,
    np.diag([1.0, -1.0, -1.0]) @ TILT,
    (1.5, 1.2, 2.6),
)
ALPHA = Livery(
    "alpha", (Circle("red", 0.12, 0.0), Circle("green", -0.08, 0.09), Circle("blue", -0.08, -0.09)), 0.3, 0.03
)
BRAVO = Livery(
    "bravo", (Circle("red", 0.12, 0.0), Circle("blue", -0.05, 0.11), Circle("green", -0.1, -0.06)), 0.3, 0.03
)
BGR = {"red": (30, 30, 220), "green": (40, 200, 40), "blue": (220, 60, 30)}


def paint(poses, rng, liveries=(ALPHA, BRAVO)):
    """Circles as finely divided polygons through OpenCV's projection, four times oversampled."""
    scale = 4
    canvas = np.full((480 * scale, 640 * scale, 3), 90, np.uint8)
    camera_from_table = CAMERA.table_from_camera.T
    matrix = np.array([[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1.0]])
    around = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    for livery, (x, y, heading) in zip(liveries, poses, strict=True):
        c, s = np.cos(heading), np.sin(heading)
        for circle in livery.circles:
            cx = x + c * circle.x_body_m - s * circle.y_body_m
            cy = y + s * circle.x_body_m + c * circle.y_body_m
            rim = np.column_stack(
                (
                    cx + livery.radius_m * np.cos(around),
                    cy + livery.radius_m * np.sin(around),
                    np.full(120, livery.height_table_m),
                )
            )
            seen = (rim - CAMERA.position_table_m) @ camera_from_table.T
            uv, _ = cv2.projectPoints(seen[:, None], np.zeros(3), np.zeros(3), matrix, np.array(DISTORTION))
            fine = (uv[:, 0] + 0.5) * scale - 0.5
            cv2.fillPoly(canvas, [np.round(fine * 16).astype(np.int32)], BGR[circle.colour], shift=4)
    image = cv2.resize(canvas, (640, 480), interpolation=cv2.INTER_AREA).astype(float)
    return np.clip(image + rng.normal(0, 3.0, image.shape), 0, 255).astype(np.uint8)


def errors(fix, pose):
    turn = np.angle(np.exp(1j * (fix.heading_rad - pose[2])))
    return np.array([fix.x_m - pose[0], fix.y_m - pose[1], turn])


def test_two_mock_ups_are_found_at_once_with_a_true_covariance():
    rng = np.random.default_rng(51)
    ratios = []
    for _ in range(12):
        poses = [
            (rng.uniform(0.9, 1.3), rng.uniform(0.9, 1.5), rng.uniform(-3, 3)),
            (rng.uniform(1.7, 2.1), rng.uniform(0.9, 1.5), rng.uniform(-3, 3)),
        ]
        fixes = {fix.vehicle: fix for fix in find_mock_ups(paint(poses, rng), CAMERA, (ALPHA, BRAVO))}
        assert set(fixes) == {"alpha", "bravo"}
        for name, pose in zip(("alpha", "bravo"), poses, strict=True):
            error = errors(fixes[name], pose)
            assert np.hypot(*error[:2]) < 1e-3
            assert abs(error[2]) < np.deg2rad(0.5)
            ratios.append(error @ np.linalg.solve(fixes[name].cov, error) / 3)
    assert 0.3 < np.mean(ratios) < 3.0


def test_a_mock_up_that_is_not_there_is_not_found():
    rng = np.random.default_rng(52)
    fixes = find_mock_ups(paint([(1.4, 1.2, 0.7)], rng, (ALPHA,)), CAMERA, (ALPHA, BRAVO))
    assert [fix.vehicle for fix in fixes] == ["alpha"]
    assert find_mock_ups(np.full((480, 640, 3), 90, np.uint8), CAMERA, (ALPHA, BRAVO)) == []


def test_grey_pictures_and_circles_on_a_line_are_refused_in_words():
    with pytest.raises(ValueError, match="colour"):
        find_mock_ups(np.zeros((480, 640), np.uint8), CAMERA, (ALPHA,))
    with pytest.raises(ValueError, match="one line"):
        Livery(
            "bad", (Circle("red", 0.0, 0.0), Circle("green", 0.1, 0.0), Circle("blue", 0.2, 0.0)), 0.3, 0.03
        )
