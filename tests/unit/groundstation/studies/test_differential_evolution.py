"""The study of differential evolution, in small: the published table, and angles of two CubeSats."""

import math
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from groundstation.relative_navigation.error_table import PUBLISHED_STAGE
from groundstation.studies.evolution import cubesats
from groundstation.studies.evolution.cubesats import draw_angles, separate
from groundstation.studies.evolution.stage import MARKERS_M, exact_run, stage_runs
from groundstation.studies.evolution.stage_figures import draw_histograms, draw_precession, draw_table
from groundstation.studies.histograms import histograms
from groundstation.studies.study import DEFAULT, PUBLISHED

BOUND_DEG_S = np.array([0.11654, 0.26117, 0.26212])
"""Of the specification, by its own derivatives."""


def by_name(drawn):
    return {number.quantity: number for number in drawn.numbers}


def silent(text, share):
    assert 0.0 <= share <= 1.0, text


@pytest.fixture(scope="module")
def errors():
    return stage_runs(silent, 60)


def test_pixels_of_the_first_frame_are_those_of_the_drawing():
    run = exact_run()
    depth = 2.0 - MARKERS_M[:, 0]
    np.testing.assert_allclose(run.pixels[:6], 600.0 * MARKERS_M[:, 1:] / depth[:, None], atol=1e-6)
    turned = Rotation.from_rotvec(np.radians([-2.5, 1.0, 1.0])).apply(MARKERS_M)  # a second later, nearly
    later = 600.0 * turned[:, 1:] / (3.0 - turned[:, 0])[:, None]
    np.testing.assert_allclose(run.pixels[12:], later, atol=0.5)


def test_formulas_of_the_precession():
    numbers = by_name(draw_precession({}))
    assert numbers["half angle of the cone alpha, deg"].ours == pytest.approx(72.6373, abs=1e-4)
    assert numbers["momentum, kg m^2/s"].ours == pytest.approx(372.5542, abs=1e-4)
    printed = numbers["rate of precession psi' by the printed formula, deg/s"].ours
    about = numbers["rate about the momentum vector, K/In, deg/s"].ours
    assert (printed, about) == (pytest.approx(-1.48173, abs=1e-5), pytest.approx(1.48173, abs=1e-5))
    assert numbers["from the momentum to the axis, deg"].ours == pytest.approx(107.3627, abs=1e-4)


def test_both_searches_stand_at_the_bound(errors):
    np.testing.assert_allclose(errors.bound_deg_s, BOUND_DEG_S, rtol=2e-3)
    for side in (PUBLISHED, DEFAULT):
        ratio = np.sqrt(np.mean(errors.off_deg_s[side] ** 2, axis=0)) / BOUND_DEG_S
        assert np.all((ratio > 0.7) & (ratio < 1.3))
    assert np.abs(errors.off_deg_s[PUBLISHED] - errors.off_deg_s[DEFAULT]).max() < 0.03


def test_the_table_has_the_published_formulas_beside_honest_ones(errors):
    numbers = by_name(draw_table({"stage": errors}))
    off = errors.off_deg_s[PUBLISHED][:, 0]
    count = len(off)
    mean = numbers["M of wx as mean absolute error, deg/s"]
    assert mean.published == PUBLISHED_STAGE["x"][0]
    assert mean.ours == pytest.approx(np.abs(off).mean())
    assert numbers["D of wx by the published formula, deg^2/s^2"].ours == pytest.approx(
        np.sum(off**2) / (count * (count - 1))
    )
    assert numbers["sample variance of wx, deg^2/s^2"].ours == pytest.approx(np.var(off, ddof=1))
    assert numbers["rms error of wy, deg/s"].published == pytest.approx(0.2416, abs=1e-4)
    assert {number.comes_out for number in numbers.values()} == {None}, "the condition was chosen near them"
    found = by_name(draw_histograms({"stage": errors}))
    assert abs(found["mean error of wx, deg/s"].ours) < 3.0 * 0.1165 / math.sqrt(count)
    assert found["evolution and least squares apart, deg/s rms"].ours < 0.01


@pytest.fixture(scope="module")
def separated():
    return separate(silent, 10.0)


def test_the_second_cubesat_turns_as_ordered(separated):
    """Without torque across the axis it turns about one direction: its angles in closed form."""
    angle = np.radians(4.0) * separated.truth.times_s
    exact = Rotation.from_rotvec(angle[:, None] * np.array([0.0, 1.0, 1.0]) / math.sqrt(2.0))
    psi, theta, phi = exact.as_euler("ZYX").T
    found = separated.angles_rad(separated.truth.camera_from_body)
    # the camera's craft turns with its orbit, 0.065 deg/s
    np.testing.assert_allclose(found, np.stack((phi, theta, psi), axis=1), atol=0.013)
    assert separated.truth.positions_camera_m[-1, 2] == pytest.approx(3.5, abs=0.01)


def test_errors_of_single_frames_grow_and_a_filter_keeps_them_small(separated):
    numbers = by_name(draw_angles({"CubeSats": separated}))
    near, far = (numbers[f"error of the turn, {span} s, rad rms"] for span in ("0 to 3", "7 to 10"))
    assert 0.01 < near.ours < 0.04
    assert 1.5 * near.ours < far.ours < 0.12
    assert far.default < 0.5 * far.ours
    table = by_name(cubesats.draw_table({"CubeSats": separated}))
    assert table["mean error of psi, 10 s, rad"].published == 0.080
    largest, mean = (table[f"{which} error of phi, 10 s, rad"].ours for which in ("largest", "mean"))
    off = np.abs(separated.off_rad(PUBLISHED)[:, 0])
    assert (largest, mean) == (pytest.approx(off.max()), pytest.approx(off.mean()))
    assert 0.005 < mean < largest < 0.2


def test_a_histogram_counts_every_value():
    values = np.array([-5.0, -0.1, 0.1, 0.1, 0.9])
    drawn = histograms([("w", [values, values])], [("v1", "a"), ("v0", "b")], 1.0, 4, "errors", "x")
    heights = [float(x) for x in re.findall(r'class="bar v1"[^>]*height="([\d.]+)"', drawn)]
    assert len(heights) == 4
    np.testing.assert_allclose(np.array(heights) / sum(heights), [0.2, 0.2, 0.4, 0.2], atol=0.01)
