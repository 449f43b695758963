"""The published least squares for constant offsets, each sum against values worked out by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from groundstation.fusion.flight_data import FlightData
from groundstation.fusion.published_offset_fit import (
    StretchStart,
    WayInOffsets,
    fit_published_offsets,
    nearest_samples,
    normal_equations,
    way_in_offsets,
)
from groundstation.fusion.published_steps import Moving, stepped
from groundstation.fusion.published_stretch import fit_published_stretch

START = StretchStart(1.0, 0.5, -0.3, 0.02, -0.01)


def test_the_way_is_linear_in_the_offsets_as_printed():
    """Two samples, d = 0.5 and 0.2, headings 30 and 60 deg."""
    end_s, heading = np.array([1.5, 1.7]), np.deg2rad([30.0, 60.0])
    force = np.array([[0.1, 0.3], [-0.2, 0.4]])
    way = way_in_offsets(START, end_s, heading, force)
    half, root = 0.5, math.sqrt(0.75)
    cos, sin = (root, half), (-half, -root)  # of phi, minus the heading

    def sums(g):
        first = 1.5 * g[0] * 0.25
        return [first, g[0] * 0.5 * 0.2 + 1.5 * (g[0] * 0.25 + g[1] * 0.04)]

    ax = [0.1 * cos[0] - 0.2 * sin[0], 0.3 * cos[1] + 0.4 * sin[1]]
    ay = [-0.2 * cos[0] - 0.1 * sin[0], 0.4 * cos[1] - 0.3 * sin[1]]
    drift = np.array([0.5, 0.7])
    assert way.f_m[0] == pytest.approx(0.5 + 0.02 * drift + sums(ax))
    assert way.f_m[1] == pytest.approx(-0.3 - 0.01 * drift + sums(ay))
    assert way.p_s2[0] == pytest.approx(np.negative(sums(cos)))
    assert way.q_s2[0] == pytest.approx(np.negative(sums(sin)))
    assert way.p_s2[1] == pytest.approx(sums(sin))
    assert way.q_s2[1] == pytest.approx(np.negative(sums(cos)))


def test_the_way_with_offsets_is_what_the_steps_give_of_readings_without_them():
    rng = np.random.default_rng(4)
    n, alpha, beta = 40, 0.005, -0.004
    d, rate, force = rng.uniform(0.01, 0.03, n), rng.normal(0.0, 0.3, n), rng.normal(0.0, 0.05, (2, n))
    heading = 0.4 + np.cumsum(rate * d)
    way = way_in_offsets(START, 1.0 + np.cumsum(d), heading, force).at(alpha, beta)
    state = Moving(0.4, START.vx_m_s, START.vy_m_s, START.x_m, START.y_m)
    for step in range(n):
        state = stepped(state, rate[step], (force[0, step] - alpha, force[1, step] - beta), d[step])
        assert (state.x_m, state.y_m) == pytest.approx(way[:, step], abs=1e-12)


def test_the_normal_equations_are_those_printed():
    f = np.array([[1.0, 2.0, 9.0], [0.5, -1.0, 9.0]])
    p = np.array([[-1.0, -3.0, 9.0], [0.5, 2.0, 9.0]])
    q = np.array([[-0.5, -1.0, 9.0], [-1.0, -3.0, 9.0]])
    star = np.array([[0.9, 2.3], [0.7, -1.1]])
    a, right = normal_equations(WayInOffsets(f, p, q), np.array([0, 1]), star)
    assert a[0, 0] == pytest.approx(1.0 + 9.0 + 0.25 + 4.0)
    assert a[0, 1] == a[1, 0] == pytest.approx(0.5 + 3.0 - 0.5 - 6.0)
    assert a[1, 1] == pytest.approx(0.25 + 1.0 + 1.0 + 9.0)
    assert right[0] == pytest.approx(-1.0 * 0.1 - 3.0 * -0.3 + 0.5 * -0.2 + 2.0 * 0.1)
    assert right[1] == pytest.approx(-0.5 * 0.1 - 1.0 * -0.3 - 1.0 * -0.2 - 3.0 * 0.1)


def test_the_printed_solution_has_the_wrong_sign():
    """Made data with known offsets: the gradient vanishes at A xi = -f, the print says A^-1 f."""
    rng = np.random.default_rng(2)
    n, alpha, beta = 1000, 0.005, -0.004
    end_s = 1.0 + 0.01 * np.arange(1, n + 1)
    heading, force = 0.3 * np.sin(end_s), rng.normal(0.0, 0.01, (2, n))
    way = way_in_offsets(START, end_s, heading, force)
    sample = np.arange(60, n, 65)
    fit = fit_published_offsets(way, sample, way.at(alpha, beta)[:, sample])
    assert (fit.alpha_m_s2, fit.beta_m_s2) == pytest.approx((alpha, beta), abs=1e-12)
    assert fit.printed == pytest.approx((-alpha, -beta), abs=1e-12)
    assert fit.residual_rms_m < 1e-12
    truth = way.at(alpha, beta)[:, sample]
    assert fit.before_rms_m == pytest.approx(np.sqrt(np.mean((way.f_m[:, sample] - truth) ** 2)))
    # of the pair it is a minimum: any other leaves more
    noisy = truth + rng.normal(0.0, 0.001, truth.shape)
    best = fit_published_offsets(way, sample, noisy)
    for more in ((1e-5, 0.0), (-1e-5, 0.0), (0.0, 1e-5), (0.0, -1e-5)):
        other = way.at(best.alpha_m_s2 + more[0], best.beta_m_s2 + more[1])[:, sample] - noisy
        assert np.sqrt(np.mean(other**2)) > best.residual_rms_m


def test_a_fix_stands_beside_its_nearest_sample():
    end_s = np.array([1.0, 1.1, 1.2, 1.3])
    assert nearest_samples(end_s, np.array([0.2, 1.04, 1.06, 1.15, 1.29, 9.0])).tolist() == [0, 0, 1, 1, 3, 3]


def flight(noise, alpha=0.005, beta=-0.004, drift=0.0):
    """A rest of 2 s, then a glide in circles that the accelerometers read with constant offsets."""
    noise = replace(noise, imu_offset_x_m=0.0, imu_offset_y_m=0.0)
    t = 0.01 * np.arange(1, 2401)
    imu = np.column_stack([t, np.full_like(t, 0.02), np.full_like(t, 0.03), np.full_like(t, -0.05), 20 * t])
    moving = t > 2.0
    imu[moving, 1] += 0.1
    push = 0.02 * np.cos(t[moving])
    imu[moving, 2] += push + alpha + drift * (t[moving] - 2.0)
    imu[moving, 3] += beta
    state, poses = Moving(0.7, 0.0, 0.0, 0.2, 0.1), []
    for row, force in zip(np.flatnonzero(moving), push, strict=True):
        state = stepped(state, 0.1, (force, 0.0), 0.01)
        poses.append((t[row], *state[3:], state.heading_rad))
    rest = [(1.0, 1.6, 0.2, 0.1, 0.7), (1.9, 2.5, 0.2, 0.1, 0.7)]
    stars = np.array([*rest, *((s, s + 0.6, x, y, h) for s, x, y, h in poses[64::65])])
    return FlightData(imu, stars, np.zeros((len(stars), 3, 3)), 2.0, noise)


def test_a_stretch_from_the_rest_gives_the_offsets_beyond_its_zeros(noise):
    found = fit_published_stretch(flight(noise), 0.0, 12.0)
    assert found.zeros == pytest.approx((0.02, 0.03, -0.05))
    assert (found.fit.alpha_m_s2, found.fit.beta_m_s2) == pytest.approx((0.005, -0.004), abs=1e-9)
    assert len(found.fix_s) == 15


def test_a_stretch_in_flight_starts_from_two_fixes(noise):
    found = fit_published_stretch(flight(noise), 5.0, 15.0)
    assert (found.fit.alpha_m_s2, found.fit.beta_m_s2) == pytest.approx((0.005, -0.004), abs=2e-3)
    assert found.fit.before_rms_m > 3.0 * found.fit.residual_rms_m


def test_a_zero_that_drifts_is_fitted_over_ten_seconds_and_not_over_twenty(noise):
    data = flight(noise, drift=0.0005)
    short, long = (fit_published_stretch(data, 0.0, end_s).fit for end_s in (12.0, 22.0))
    assert long.residual_rms_m > 6.0 * short.residual_rms_m  # grows with the cube of the time


def test_samples_beyond_the_limits_are_left_out(noise):
    data = flight(noise)
    imu = data.imu.copy()
    imu[500, 2] = 5.0
    found = fit_published_stretch(replace(data, imu=imu), 0.0, 12.0)
    assert (found.fit.alpha_m_s2, found.fit.beta_m_s2) == pytest.approx((0.005, -0.004), abs=1e-4)


@pytest.mark.parametrize(("start_s", "end_s", "words"), [(5.0, 5.5, "3 fixes"), (0.0, 2.1, "too few")])
def test_too_little_is_refused(noise, start_s, end_s, words):
    with pytest.raises(ValueError, match=words):
        fit_published_stretch(flight(noise), start_s, end_s)
