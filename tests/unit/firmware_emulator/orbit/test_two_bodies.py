"""Two craft integrated about the Earth's centre, against what is known in closed form."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from firmware_emulator.orbit.two_bodies import GM_M3_S2, integrate, orbital_axes, place_in_orbit

RADIUS_M = 6878.5e3
RATE = np.sqrt(GM_M3_S2 / RADIUS_M**3)
STILL = Rotation.identity()
SPHERE = np.ones(3)


def circle(radius, t):
    n = np.sqrt(GM_M3_S2 / radius**3)
    c, s = np.cos(n * t), np.sin(n * t)
    return radius * np.array([c, s, 0]), radius * n * np.array([-s, c, 0])


def test_a_craft_on_a_higher_circle_lags_as_kepler_says():
    times = np.array([0.0, 1500.0, 3000.0])
    first, second = circle(RADIUS_M, 0.0), circle(RADIUS_M + 100.0, 0.0)
    away = second[0] - first[0], second[1] - first[1]
    found = integrate(times, first, away, STILL, np.zeros(3), SPHERE)
    for row, t in enumerate(times):
        exact = circle(RADIUS_M + 100.0, t)[0] - circle(RADIUS_M, t)[0]
        np.testing.assert_allclose(found.away_m[row], exact, atol=2e-5)
        np.testing.assert_allclose(found.first_m[row], circle(RADIUS_M, t)[0], atol=2e-3)


def test_metres_beside_thousands_of_kilometres_do_not_cancel():
    """A micrometre of distance stays one to many digits: half an orbit later, seen from the other side."""
    times = np.array([0.0, np.pi / RATE])
    first = circle(RADIUS_M, 0.0)
    away = np.array([0.0, 0.0, 1e-6]), np.zeros(3)  # out of the plane: swings as cos(n t)
    found = integrate(times, first, away, STILL, np.zeros(3), SPHERE)
    np.testing.assert_allclose(found.away_m[1], [0.0, 0.0, -1e-6], atol=1e-11)


def test_an_eccentric_orbit_has_its_perigee_and_axes():
    place, pace = place_in_orbit(7e6, 0.1, 0.0)
    np.testing.assert_allclose(place, [6.3e6, 0, 0])
    np.testing.assert_allclose(pace, [0, np.sqrt(GM_M3_S2 * (2 / 6.3e6 - 1 / 7e6)), 0])
    place, pace = place_in_orbit(7e6, 0.1, np.pi / 2)
    assert place @ pace > 0.0  # on its way up
    (axes,), (rate,) = orbital_axes(place[None], pace[None])
    np.testing.assert_allclose(axes, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert rate == pytest.approx(np.sqrt(GM_M3_S2 * 7e6 * 0.99) / np.linalg.norm(place) ** 2)


def test_a_body_of_revolution_precesses():
    """Its axis turns about the momentum by K / In."""
    inertia, rate = np.array([2548.0, 14406.0, 14406.0]), np.radians([-2.5, 1.0, 1.0])
    times = np.linspace(0.0, 120.0, 7)
    far = place_in_orbit(1e12, 0.0, 0.0)  # without gravity gradient
    found = integrate(times, far, (np.array([1.0, 0, 0]), np.zeros(3)), STILL, rate, inertia)
    momentum = inertia * rate
    for t, turned in zip(times, found.inertial_from_body, strict=True):
        swung = Rotation.from_rotvec(momentum / 14406.0 * t).apply([1.0, 0, 0])
        np.testing.assert_allclose(turned.apply([1.0, 0, 0]), swung, atol=1e-8)
    kept = found.inertial_from_body.apply(found.rates_body_rad_s * inertia)
    np.testing.assert_allclose(kept, np.broadcast_to(momentum, kept.shape), rtol=1e-7, atol=1e-6)


def test_gravity_gradient_swings_a_dumb_bell_in_pitch():
    """About the vertical with the frequency n sqrt(3 (Iy - Ix) / Iz), the long axis x up, z the normal."""
    inertia = np.array([0.2, 1.0, 1.0])
    off = 0.02
    first = circle(RADIUS_M, 0.0)
    times = np.array([0.0, np.pi / (RATE * np.sqrt(3.0 * 0.8 / 1.0))])  # half a swing
    start = Rotation.from_rotvec([0, 0, off])
    rate = np.array([0, 0, RATE])
    found = integrate(times, first, (np.array([0.0, 1.0, 0]), np.zeros(3)), start, rate, inertia)
    up = found.first_m[1] + found.away_m[1]
    pitch = np.arctan2(*found.inertial_from_body[1].inv().apply(up)[[1, 0]])
    assert -pitch == pytest.approx(-off, rel=0.01)
