"""A board on the table and a tape: what agrees is fitted, a contradiction is refused with its cause."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from calibration.outcome import CalibrationRefusedError
from calibration.overhead.camera_pose import POSE, BoardView
from calibration.overhead.procedure import pose_by_board
from groundstation.overhead.overhead_camera import OverheadCamera

CAMERA = OverheadCamera(
    960, 720, 471.2, 472.0, 476.4, 362.1, (-0.055, 0.009, 0.0006, -0.0004, 0.0),
    (0.03, -0.02, 2.6), 0.015, 0.011, -0.008,
)  # fmt: skip
TRUTH = (*CAMERA.position_table_m, CAMERA.yaw_rad, CAMERA.tilt_x_rad, CAMERA.tilt_y_rad)
PLACES = [(-1.2, 0.9, 10.0), (0.3, -0.2, -70.0), (0.1, 1.1, -15.0)]
TAPE_M, TAPE_RAD = 2e-3, math.radians(0.2)


def view(place, rng, name):
    """One picture of a board of 6x4 squares of 150 mm, its place by tape."""
    x, y, heading = place[0], place[1], math.radians(place[2])
    across, down = np.meshgrid(0.15 * np.arange(1, 6), 0.15 * np.arange(1, 4))
    board = np.stack((across.ravel(), down.ravel(), np.zeros(15)), axis=1)
    c, s = math.cos(heading), math.sin(heading)
    table = np.stack(
        (x + c * board[:, 0] + s * board[:, 1], y + s * board[:, 0] - c * board[:, 1], np.zeros(15)), axis=1
    )
    seen = (table - CAMERA.position_table_m) @ CAMERA.table_from_camera()
    matrix = np.array([[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1.0]])
    pixel, _ = cv2.projectPoints(seen, np.zeros(3), np.zeros(3), matrix, np.array(CAMERA.distortion))
    pixel = pixel.reshape(-1, 2) + rng.normal(0.0, 0.1, (15, 2))
    off = rng.normal(0.0, 1.0, 3) * (TAPE_M, TAPE_M, TAPE_RAD)
    return BoardView(board, pixel, x + off[0], y + off[1], heading + off[2], name)


def taken(seed=1):
    rng = np.random.default_rng(seed)
    return [view(place, rng, f"p{k}") for k, place in enumerate(PLACES)]


def found(views):
    return pose_by_board(views, CAMERA, TAPE_M, TAPE_RAD)


def moved(views, change):
    return [
        replace(v, **dict(zip(("x_m", "y_m", "heading_rad"), change(*v.tape), strict=True))) for v in views
    ]


def test_a_tape_as_good_as_stated_is_accepted_and_its_sigma_is_true():
    off = []
    for seed in range(30):
        outcome = found(taken(seed))
        off.append(
            [
                (outcome.quantities[n].value - t) / outcome.quantities[n].sigma
                for n, t in zip(POSE, TRUTH, strict=True)
            ]
        )
    assert 0.6 < np.sqrt(np.square(off).mean()) < 1.2
    assert np.abs(off).max() < 4.5


def test_a_tape_somewhat_worse_than_stated_is_accepted_with_larger_sigmas():
    plain = taken()
    worse = one_wild(1, 0.02)(taken())
    one, other = found(plain), found(worse)
    assert other.quantities["x_m"].sigma > 1.3 * one.quantities["x_m"].sigma
    assert abs(other.quantities["x_m"].value - TRUTH[0]) < 3.0 * other.quantities["x_m"].sigma
    assert "times as far as stated" in other.warnings[0]


def one_wild(k, x_m):
    def change(views):
        views[k] = replace(views[k], x_m=views[k].x_m + x_m)
        return views

    return change


def swapped(views):
    a, b = views[0].tape, views[1].tape
    return [*moved(views[:1], lambda *_: b), *moved(views[1:2], lambda *_: a), views[2]]


WRONG = {
    "millimetres": (lambda v: moved(v, lambda x, y, h: (1e3 * x, 1e3 * y, h)), "in mm, metres are expected"),
    "centimetres": (lambda v: moved(v, lambda x, y, h: (1e2 * x, 1e2 * y, h)), "in cm, metres are expected"),
    "inches": (lambda v: moved(v, lambda x, y, h: (x / 0.0254, y / 0.0254, h)), "in inches"),
    "feet": (lambda v: moved(v, lambda x, y, h: (x / 0.3048, y / 0.3048, h)), "in feet"),
    "x and y": (lambda v: moved(v, lambda x, y, h: (y, x, h)), "x and y are swapped"),
    "x and y of one": (lambda v: [*moved(v[:1], lambda x, y, h: (y, x, h)), *v[1:]], "x and y of 'p0' are"),
    "sign of x": (lambda v: moved(v, lambda x, y, h: (-x, y, h)), "x has the wrong sign"),
    "sign of y": (lambda v: moved(v, lambda x, y, h: (x, -y, h)), "y has the wrong sign"),
    "mirrored": (lambda v: moved(v, lambda x, y, h: (x, -y, -h)), "the table is mirrored"),
    "sign of headings": (lambda v: moved(v, lambda x, y, h: (x, y, -h)), "headings have the wrong sign"),
    "half a turn": (lambda v: moved(v, lambda x, y, h: (x, y, h + math.pi)), "half a turn off"),
    "short edge": (lambda v: moved(v, lambda x, y, h: (x, y, h - math.pi / 2)), "of the short edge"),
    "radians": (lambda v: moved(v, lambda x, y, h: (x, y, math.radians(h))), "seem to be in radians"),
    "two places swapped": (swapped, "the places of 'p0' and 'p1' are swapped"),
    "one wild": (one_wild(1, 0.1), "the place of 'p1' is wrong, the others agree"),
    "one wild, the first": (one_wild(0, 1.0), "the place of 'p0' is wrong, the others agree"),
    "a smaller board": (
        lambda v: [replace(each, board_m=each.board_m / 1.5) for each in v],
        r"with squares 1\.(49|50|51)",
    ),
    "a board 1 % smaller": (
        lambda v: [replace(each, board_m=each.board_m / 1.01) for each in v],
        "times as large as stated they agree: measure one",
    ),
    "one place for all": (lambda v: moved(v, lambda *_: v[0].tape), "with one place in places.csv show"),
    "a picture with two places": (
        lambda v: [*v, replace(v[0], x_m=0.0, name="p3")],
        "pictures 'p0' and 'p3' are one and the same, but have two places",
    ),
    "corners of another board": (
        lambda v: [replace(v[0], pixel=v[0].pixel + 8.0 * np.sin(v[0].pixel))],
        "corners are left",
    ),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_contradicts_itself_is_refused_with_its_cause(what):
    spoil, words = WRONG[what]
    with pytest.raises(CalibrationRefusedError, match=words):
        found(spoil(taken()))


def test_a_picture_given_twice_counts_once():
    once, twice = found(taken()), found([*taken(), replace(taken()[0], name="copy")])
    assert twice.quantities == once.quantities
    assert twice.warnings == ("picture 'copy' came twice and counts once",)


def test_two_pictures_of_one_place_hold_one_tape():
    views = taken()[:1]
    again = view(PLACES[0], np.random.default_rng(9), "again")
    pair = [*views, *moved([again], lambda *_: views[0].tape)]
    one, two = (pose_by_board(some, CAMERA, 0.05, TAPE_RAD).quantities["x_m"].sigma for some in (views, pair))
    assert two > 0.95 * one
    assert "one place checks no tape" in found(views).warnings[0]
