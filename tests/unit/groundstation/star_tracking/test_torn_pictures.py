"""Pictures whose parts show two skies give no fix; whole ones lose none."""

import numpy as np
import pytest

from groundstation.star_tracking.detection import detect
from groundstation.star_tracking.fixes import NoFix, PictureFix, Refusal
from groundstation.star_tracking.picture_repeats import PictureRepeats
from groundstation.star_tracking.tracker import StarTracker

ROWS, COLUMNS = 480, 640


def rolled(rng, picture, _):
    row = rng.integers(60, 420)
    return np.vstack((picture[:row], np.roll(picture[row:], rng.integers(10, COLUMNS - 10), axis=1)))


def bytes_lost(rng, picture, _):
    at, lost = rng.integers(60 * COLUMNS, 400 * COLUMNS), rng.integers(10, 4000)
    flat = picture.ravel()
    return np.concatenate((flat[:at], flat[at + lost :], flat[:lost])).reshape(picture.shape)


def rows_twice(rng, picture, _):
    row, count = rng.integers(60, 300), rng.integers(4, 100)
    return np.vstack((picture[: row + count], picture[row:]))[:ROWS]


def rows_over(rng, picture, _):
    row, count = rng.integers(0, 200), rng.integers(8, 130)
    torn = picture.copy()
    torn[row + count : row + 2 * count] = picture[row : row + count]
    return torn


def upper_half_of_another(_rng, picture, other):
    return np.vstack((other[: ROWS // 2], picture[ROWS // 2 :]))


TEARS = (rolled, bytes_lost, rows_twice, rows_over, upper_half_of_another)


@pytest.fixture(scope="module")
def sky(painter):
    """Eight pictures with the pose of each, and one of a moment before."""
    rng = np.random.default_rng(31)
    views = []
    for _ in range(8):
        pose = np.array([rng.uniform(1.4, 3.6), rng.uniform(1.2, 2.8), rng.uniform(-3, 3)])
        before = pose - rng.choice([-1, 1], 3) * rng.uniform((0.004, 0.004, 0.0), (0.02, 0.02, 0.03))
        views.append((pose, painter.paint(rng, pose), painter.paint(rng, before)))
    return views


def is_false(fix, pose):
    turn = np.angle(np.exp(1j * (fix.heading_rad - pose[2])))
    off = np.array([fix.x_m - pose[0], fix.y_m - pose[1], turn])
    return np.hypot(*off[:2]) > 2e-3 or off @ np.linalg.solve(fix.covariance, off) > 30.0


@pytest.mark.parametrize("tear", TEARS)
@pytest.mark.parametrize("is_known", [False, True])
def test_a_torn_picture_gives_no_false_fix(catalogue, camera, sky, tear, is_known):
    """Whether the picture of before was seen or not."""
    tracker, rng, refused = StarTracker(catalogue, camera), np.random.default_rng(5), 0
    for pose, picture, before in sky:
        repeats = PictureRepeats()
        if is_known:
            assert not repeats.complaint_about(before, 0)
        torn = np.ascontiguousarray(tear(rng, picture, before))
        complaint = repeats.complaint_about(torn, 1)
        answer = tracker.solve(detect(torn))
        assert bool(complaint) or isinstance(answer, NoFix) or not is_false(answer, pose)
        refused += bool(complaint) or isinstance(answer, NoFix)
    assert refused > 3  # the others rest on the part that is right


def test_a_part_moved_by_less_than_a_gate_is_torn_too(catalogue, camera, sky, painter):
    tracker, rng = StarTracker(catalogue, camera), np.random.default_rng(6)
    for pose, picture, _ in sky:
        other = painter.paint(rng, pose + np.array([0.002, -0.001, 0.004]))
        answer = tracker.solve(detect(upper_half_of_another(rng, picture, other)))
        assert isinstance(answer, NoFix)
        assert answer.reason is Refusal.TORN
        assert answer.guess is not None


def test_dead_stars_stray_lights_and_covered_parts_are_no_tears(catalogue, camera, painter):
    """One in fifty may be refused: the lights at an end may look like other stars by chance."""
    tracker, rng, refused = StarTracker(catalogue, camera), np.random.default_rng(7), 0
    for number in range(54):
        pose = (rng.uniform(1.4, 3.6), rng.uniform(1.2, 2.8), rng.uniform(-3, 3))
        lit = rng.random(len(painter.stars_m)) > (0.0, 0.2, 0.4)[number % 3]
        lights = [(*rng.uniform((5, 5), (635, 475)), 4e4) for _ in range((0, 3, 9)[number // 3 % 3])]
        picture = painter.paint(rng, pose, lit=lit, lights=lights)
        if number % 9 == 0:
            shade = np.clip((np.arange(ROWS)[:, None] - rng.integers(0, 150)) / 80.0, 0.0, 1.0)
            picture = (10 + (picture.astype(float) - 10) * shade).clip(0, 255).astype(np.uint8)  # a hand
        answer = tracker.solve(detect(picture))
        refused += isinstance(answer, NoFix)
        assert isinstance(answer, NoFix) or not is_false(answer, pose)
    assert refused <= 1


def test_an_ordinary_picture_is_whole(catalogue, camera, sky):
    tracker = StarTracker(catalogue, camera)
    assert all(isinstance(tracker.solve(detect(picture)), PictureFix) for _, picture, _ in sky)
