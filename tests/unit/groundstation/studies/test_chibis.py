"""The study of the Chibis-M, in small: what comes out, and what it hangs on."""

import re
from dataclasses import replace

import numpy as np
import pytest

from groundstation.studies.chibis.condition import simulation
from groundstation.studies.chibis.orbits import draw_orbits, relative_orbit
from groundstation.studies.chibis.robustness import CASES, right_share, run_case
from groundstation.studies.chibis.simulation import simulate, tip_px
from groundstation.studies.chibis.simulation_figures import draw_course, draw_errors
from groundstation.studies.chibis.study import CHIBIS
from groundstation.studies.chibis.video import film
from groundstation.studies.chibis.video_figures import draw_frames, draw_motion
from groundstation.studies.chibis.working_time import critical_mm, draw_working_time, sweep_all
from groundstation.studies.study import DEFAULT, PUBLISHED


def silent(text, share):
    assert 0.0 <= share <= 1.0, text


def by_name(drawn):
    return {number.quantity: number for number in drawn.numbers}


@pytest.fixture(scope="module")
def simulated():
    return simulate(simulation(12.0, 900.0), silent)


def test_the_motion_is_the_published_one(simulated):
    """Times and place of the specification, from a matrix exponential."""
    found = by_name(draw_course({"simulation": simulated}))
    for metres, seconds in ((5, 182.0), (10, 521.0), (15, 764.0)):
        assert found[f"distance {metres} m is reached at, s"].ours == pytest.approx(seconds, abs=1.5)
    assert found["off the vertical at 15 m, deg"].ours == pytest.approx(31.5, abs=0.3)
    rate = np.linalg.norm(simulated.truth.rates_body_rad_s, axis=1)
    np.testing.assert_allclose(rate, 0.01, rtol=0.2)


def test_errors_grow_and_the_tips_are_lost_below_a_pixel(simulated):
    found = by_name(draw_errors({"simulation": simulated}))
    near, far = found["position error up to 3.5 m, m rms"], found["position error at 13.5 to 15 m, m rms"]
    assert (near.published, far.published) == (0.01, 0.4)
    assert 0.0008 < near.ours < 0.01
    assert 0.05 < far.ours < 0.4
    assert far.default < 0.1 * far.ours
    assert near.default < 0.3 * near.ours
    assert 0.6 < found["attitude error at 13.5 to 15 m, deg rms"].ours < 4.0
    assert found["distance at the last solved frame, m"].ours == pytest.approx(15.0, abs=1.2)
    assert found["distance at the last solved frame, m"].is_put_in
    tip = found["tip at the last solved frame, px"]
    assert 0.75 < tip.ours < 1.0
    assert tip.comes_out
    for side in (PUBLISHED, DEFAULT):
        course, last = simulated.courses[side], simulated.last(side)
        assert course.is_solved[: last + 1].mean() > 0.9
        assert not course.is_solved[last + 1 :].any()
        assert tip_px(simulated, side) == pytest.approx(
            750.0 * 0.016 / simulated.truth.positions_camera_m[last, 2]
        )


def test_what_is_propagated_leaves_the_truth_by_the_error_of_its_rates(simulated):
    course, last = simulated.courses[PUBLISHED], simulated.last(PUBLISHED)
    after = len(course.times_s) - 1
    span_s = course.times_s[after] - course.times_s[last]
    assert span_s > 80.0
    off = course.velocities_m_s[last] - simulated.truth.velocities_orbital_m_s[last]
    carried = simulated.order.camera_from_orbital @ off * span_s + course.off_m[last]
    np.testing.assert_allclose(course.off_m[after], carried, atol=0.25 * np.linalg.norm(carried) + 0.05)
    assert simulated.courses[DEFAULT].away_m[after] < 0.05
    assert simulated.courses[DEFAULT].away_deg[after] < 0.5


@pytest.mark.parametrize(
    ("words", "published", "default"),
    [
        ("as it should be", True, True),
        ("eps 0.5 px", False, True),
        ("eps 40 px", True, True),
        ("start 10 deg off", True, True),
        ("start 60 deg off", False, True),
        ("start 50 % too far", False, True),
        ("inertia, axes x and z exchanged", True, True),
        ("orbit of 600 km instead of 500", True, True),
    ],
)
def test_wrong_settings_lose_the_target_or_do_not(simulated, words, published, default):
    (case,) = [case for case in CASES if case.words == words]
    for side, is_followed in ((PUBLISHED, published), (DEFAULT, default)):
        share = right_share(simulated, run_case(simulated, case, side), side)
        assert (share > 0.9) if is_followed else (share < 0.1)


@pytest.mark.parametrize(
    ("solved", "gap", "last"),
    [
        ("111000", 3, 2),
        ("1110001", 3, 2),
        ("1101001", 3, 6),
        ("0001", 3, None),
        ("0011", 3, 3),
        ("", 2, None),
    ],
)
def test_the_work_ends_before_a_gap(simulated, solved, gap, last):
    course = replace(simulated.courses[PUBLISHED], is_solved=np.array([each == "1" for each in solved], bool))
    assert course.last_solved(gap) == last


@pytest.mark.slow
def test_working_time_grows_with_the_tips_from_a_critical_size_on():
    sweep = sweep_all(silent, 40.0, ("tips",))["tips"]
    for side in (PUBLISHED, DEFAULT):
        assert sweep.working_s[side][0] == 0.0  # 2 mm: half a pixel at 3 m
        assert 4.0 <= critical_mm(sweep, side) <= 6.0
        assert np.all(np.diff(sweep.working_s[side][:8]) >= -40.0)
        assert sweep.working_s[side][7] > 600.0
    assert by_name(draw_working_time({"working times": {"tips": sweep}}))[
        "tip at the last solved frame, px, mean over sizes"
    ].comes_out


def test_the_film_gives_velocity_and_rate_until_the_glare():
    found = film(silent, 1.0 / 10.0)
    numbers = by_name(draw_motion({"film": found}))
    for side in (PUBLISHED, DEFAULT):
        assert found.courses[side].is_solved.sum() == 31
        assert found.truth.times_s[found.last(side)] == pytest.approx(3.0)
        np.testing.assert_allclose(found.mean_velocity_m_s(side), [0.12, 0.0, 0.27], atol=0.015)
        assert np.linalg.norm(found.rate_deg_s(side)) == pytest.approx(4.5, rel=0.12)
    assert numbers["length of the rate by the gyro, deg/s"].ours == pytest.approx(4.5, abs=0.1)
    video = numbers["length of the rate by video, deg/s"]
    assert (video.published, video.comes_out) == (4.24, None)
    assert numbers["frames processed"].comes_out is None
    seen = by_name(draw_frames({"film": found}))
    assert seen["first guess off the tips, px rms"].ours > 2.0
    assert seen["estimate off the tips, px rms"].ours < 2.0


def test_the_ellipse_closes_only_without_its_first_constant():
    numbers = by_name(draw_orbits({}))
    wanders = "wanders along the track"
    assert numbers[f"C1 = 0 m: {wanders}, closed form, m a revolution"].ours == 0.0
    assert numbers[f"C1 = 0.05 m: {wanders}, closed form, m a revolution"].ours == pytest.approx(-0.3 * np.pi)
    integrated = numbers[f"C1 = 0.05 m: {wanders}, integrated, m a revolution"].ours
    assert integrated == pytest.approx(-0.3 * np.pi, abs=1e-4)
    assert numbers["C1 = 0.05 m: half axes along over up, integrated"].comes_out
    found = relative_orbit(0.05, 1.0)
    assert np.abs(found.closed_m - found.integrated_m).max() < 1e-4
    assert np.ptp(found.integrated_m[:, 0]) == pytest.approx(2.0, rel=1e-4)


def test_every_figure_of_the_paper_is_drawn_or_said_why_not():
    drawn = {number for figure in CHIBIS.figures for number in figure.numbers}
    words = " ".join(CHIBIS.not_drawn).replace("1.1 to 1.5", "1.1 1.2 1.3 1.4 1.5")
    said = set(re.findall(r"\d\.\d+", words))
    parts = {1: 5, 2: 15, 3: 7}
    assert drawn | said == {f"{part}.{k}" for part, count in parts.items() for k in range(1, count + 1)}
    assert not drawn & said
