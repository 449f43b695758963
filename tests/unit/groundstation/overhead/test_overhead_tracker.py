"""Mock-ups found from above by their coloured circles, in pictures that the emulator draws."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from firmware_emulator.overhead.scene import read_markings, read_overhead_camera
from firmware_emulator.overhead.table_view import ALBEDO, Body, Light, TableView
from groundstation.overhead.arcs import circles_of_rim
from groundstation.overhead.circle_tracker import NoOverheadFix, OverheadFix, OverheadTracker
from groundstation.overhead.liveries import Circle, Livery, load_liveries
from groundstation.overhead.overhead_camera import OverheadCamera

FILES = Path(__file__).parents[4] / "calibration" / "rigs" / "emulated"
TABLE_M = (-2.0, 2.0, -1.5, 1.5)
AWAY = (9.0, 9.0, 0.0)
ALPHA, BETA = (-0.8, 0.1, 0.3), (0.9, 0.7, 2.0)


def make_view(seed=3, light=None):
    bodies = {name: Body(marks, 0.2) for name, marks in read_markings(FILES / "circles.toml").items()}
    optics = read_overhead_camera(FILES / "overhead_camera.json")
    return TableView(optics, TABLE_M, bodies, light or Light(), np.random.SeedSequence(seed))


@pytest.fixture(scope="module")
def view():
    return make_view()


@pytest.fixture(scope="module")
def tracker():
    camera = OverheadCamera.load(FILES / "overhead_camera.json")
    return OverheadTracker(camera, load_liveries(FILES / "circles.toml"))


def picture(view, alpha=ALPHA, beta=BETA, sequence=0, hidden=None):
    return view.render({"alpha": (alpha, alpha), "beta": (beta, beta)}, sequence, hidden)


def errors(fix, pose):
    turn = np.angle(np.exp(1j * (fix.heading_rad - pose[2])))
    return np.array([fix.x_m - pose[0], fix.y_m - pose[1], turn])


def anywhere(rng, x_low, x_high):
    return rng.uniform(x_low, x_high), rng.uniform(-1.2, 1.2), rng.uniform(-3.1, 3.1)


@pytest.mark.parametrize("jpeg_quality", [None, 95])
def test_two_moving_mock_ups_are_found_at_once_with_a_true_covariance(view, tracker, jpeg_quality):
    rng = np.random.default_rng(51)
    off, ratios = [], []
    for sequence in range(14):
        poses = np.array([anywhere(rng, -1.7, -0.25), anywhere(rng, 0.25, 1.7)])
        half = rng.normal(0.0, 0.002, (2, 3))  # 10 ms at 0.4 m/s
        paths = zip(("alpha", "beta"), zip(poses - half, poses + half, strict=True), strict=True)
        image = view.render(dict(paths), sequence)
        if jpeg_quality:
            coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, jpeg_quality])[1]
            image = cv2.imdecode(coded, cv2.IMREAD_COLOR)
        for answer, pose in zip(tracker.look(image), poses, strict=True):
            assert isinstance(answer, OverheadFix)
            off.append(errors(answer, pose))
            ratios.append(off[-1] @ np.linalg.solve(answer.covariance, off[-1]) / 3)
    assert 0.5 < np.mean(ratios) < 2.0
    rms = np.sqrt(np.mean(np.square(off), axis=0))
    worse = 1.0 if jpeg_quality is None else 2.5
    assert max(rms[:2]) < worse * 0.0003  # a sixteenth of a pixel
    assert rms[2] < worse * np.radians(0.1)


def test_mock_ups_that_touch_keep_their_own_circles(view, tracker):
    poses = (-0.2, 0.1, 0.35), (0.2, 0.1, 2.9)
    for answer, pose in zip(tracker.look(picture(view, *poses)), poses, strict=True):
        assert isinstance(answer, OverheadFix)
        assert np.hypot(*errors(answer, pose)[:2]) < 0.001


def test_a_hand_over_a_circle_costs_that_mock_up_its_fix_and_no_other(view, tracker):
    answers = tracker.look(picture(view, hidden={"alpha": 1}))
    assert isinstance(answers[0], NoOverheadFix)
    assert "pattern" in answers[0].reason or "red" in answers[0].reason
    assert isinstance(answers[1], OverheadFix)


def test_a_circle_half_under_something_grey_is_found_by_its_rim(view, tracker):
    image = picture(view)
    whole = tracker.look(image)[1]
    spots = cv2.inRange(image, (0, 0, 100), (70, 70, 255))  # the red circles
    column = int(np.flatnonzero(spots[:300].any(axis=0)).max())
    image[:300, column - 4 : column + 12] = (60, 60, 60)  # a cable duct: a third of beta's red circle
    answer = tracker.look(image)[1]
    assert isinstance(answer, OverheadFix)
    assert (whole.whole, answer.whole) == (3, 2)
    assert np.hypot(*errors(answer, BETA)[:2]) < 4.0 * np.sqrt(np.trace(answer.covariance[:2, :2]))


@pytest.mark.parametrize("colour", [(1.25, 1.0, 0.6), (0.8, 1.0, 1.25)])
def test_lamps_of_the_wrong_colour_are_divided_out(tracker, colour):
    view = make_view(5, Light(colour=colour, unevenness_ratio=0.4))
    for answer, pose in zip(tracker.look(picture(view)), (ALPHA, BETA), strict=True):
        assert isinstance(answer, OverheadFix)
        assert np.hypot(*errors(answer, pose)[:2]) < 0.001


def test_what_is_not_there_is_not_found_and_said_why(view, tracker):
    answers = tracker.look(picture(view, alpha=AWAY))
    assert [type(answer) for answer in answers] == [NoOverheadFix, OverheadFix]
    assert answers[0].reason == "no three circles make its pattern"
    for answer in tracker.look(picture(view, AWAY, AWAY)):
        assert answer.reason == "no coloured circle in the picture"
    for answer in tracker.look(np.full((720, 960, 3), 90, np.uint8)):
        assert isinstance(answer, NoOverheadFix)


def test_pictures_of_clutter_give_no_fix_and_take_bounded_work(tracker):
    rng = np.random.default_rng(8)
    for _ in range(6):
        image = np.full((720, 960, 3), 100, np.uint8)
        for _ in range(60):
            rgb = ALBEDO[str(rng.choice(["red", "green", "blue", "hand"]))]
            centre = tuple(int(v) for v in rng.integers(0, (960, 720)))
            cv2.circle(image, centre, int(rng.integers(3, 16)), [255 * c for c in rgb[::-1]], -1)
        image = np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8)
        assert all(isinstance(answer, NoOverheadFix) for answer in tracker.look(image))


def test_two_mock_ups_of_one_pattern_are_refused_in_the_picture_too(view, tracker):
    twice = picture(view, alpha=(-0.8, -0.6, 0.3), beta=AWAY)
    other = picture(view, alpha=(0.6, 0.5, 1.0), beta=AWAY)
    twice[:, 480:] = other[:, 480:]
    assert tracker.look(twice)[0].reason == "its circles are seen at two places"


def test_pictures_that_are_none_of_this_camera_are_refused_in_words(tracker):
    with pytest.raises(ValueError, match="colour"):
        tracker.look(np.zeros((720, 960), np.uint8))
    with pytest.raises(ValueError, match="640 x 480"):
        tracker.look(np.zeros((480, 640, 3), np.uint8))


def test_two_circles_that_touch_are_both_found_by_their_rims():
    v, u = np.mgrid[0:40, 0:60].astype(float)
    places = 0.005 * (u + 1j * v)
    truth = [0.005 * complex(20.3, 19.6), 0.005 * complex(34.1, 20.2)]
    share = sum(np.clip(0.5 + (0.035 - np.abs(places - centre)) / 0.005, 0, 1) for centre in truth)
    found = sorted((arc.place_m for arc in circles_of_rim(share.clip(0, 1), places, 0.035, 0.005)), key=abs)
    assert len(found) == 2
    assert max(abs(a - b) for a, b in zip(found, truth, strict=True)) < 0.0005


@pytest.mark.parametrize(
    ("places", "reason"),
    [
        ((("red", 0.0, 0.0), ("green", 0.1, 0.0), ("blue", 0.2, 0.001)), "one line"),
        ((("red", 0.0, 0.0), ("green", 0.05, 0.0), ("blue", 0.0, 0.2)), "overlap"),
        ((("red", 0.1, 0.0), ("green", -0.1, 0.1), ("green", -0.1, -0.1)), None),
        ((("red", 0.1, 0.0), ("red", -0.05, 0.0866), ("red", -0.05, -0.0866)), "another turn"),
    ],
)
def test_circles_that_give_no_pose_are_refused(places, reason):
    circles = tuple(Circle(*place) for place in places)
    if reason is None:
        assert Livery("one", circles, 0.3, 0.03).vehicle == "one"
        return
    with pytest.raises(ValueError, match=reason):
        Livery("one", circles, 0.3, 0.03)
