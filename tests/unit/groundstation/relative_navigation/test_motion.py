"""Orbits and spins beside numerical integration; the published quantities of a precession."""

import numpy as np
import pytest
from oracles import motion_bank as oracle
from oracles import relative_scenes as scenes
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from groundstation.relative_navigation.attitude_motion import turn_on
from groundstation.relative_navigation.hill import hill_constants, hill_response, hill_transition
from groundstation.relative_navigation.hill_figure import draw_relative_orbit
from groundstation.relative_navigation.motion import CameraCraft
from groundstation.relative_navigation.motion_bank import (
    PLACE,
    PULL,
    ROTATION,
    SPEED,
    SPIN,
    FrameInformation,
    MotionBank,
)
from groundstation.relative_navigation.pose import Pose
from groundstation.relative_navigation.precession import AxialInertia, precess, precession_of, rate_after

RATE = 1.106819e-3  # rad/s, of the published elements of Progress


def hill_matrix(n):
    a = np.zeros((6, 6))
    a[:3, 3:] = np.eye(3)
    a[3, 0], a[3, 4], a[4, 3], a[5, 2] = 3 * n**2, 2 * n, -2 * n, -(n**2)
    return a


@pytest.mark.parametrize("rate", [0.0, 1e-9, RATE])
def test_hills_closed_form_is_the_matrix_exponential(rate):
    for t in (0.033, 4.0, 900.0, 6000.0):
        big = np.zeros((9, 9))
        big[:6, :6] = hill_matrix(rate)
        big[3:6, 6:] = np.eye(3)
        exact = expm(big * t)
        assert hill_transition(rate, t) == pytest.approx(exact[:6, :6], rel=1e-9, abs=1e-9)
        assert hill_response(rate, t) == pytest.approx(exact[:6, 6:], rel=1e-7, abs=1e-9)


def test_the_published_constants_draw_the_published_curve(rng):
    position, velocity = rng.normal(0, 10, 3), rng.normal(0, 0.02, 3)
    c = hill_constants(position, velocity, RATE)
    for t in (0.0, 500.0, 4000.0):
        z, x, y = (hill_transition(RATE, t) @ np.r_[position, velocity])[:3]
        w = RATE * t
        assert x == pytest.approx(c.c4 - 3 * c.c1 * w + 2 * c.c2 * np.cos(w) - 2 * c.c3 * np.sin(w))
        assert y == pytest.approx(c.c5 * np.sin(w) + c.c6 * np.cos(w))
        assert z == pytest.approx(2 * c.c1 + c.c2 * np.sin(w) + c.c3 * np.cos(w))
        middle_x, middle_z = c.centre_m(t)  # the ellipse is twice as long as high
        assert ((x - middle_x) / c.semi_axes_m[1]) ** 2 + (
            (z - middle_z) / c.semi_axes_m[0]
        ) ** 2 == pytest.approx(1)
    assert not c.is_bounded()
    still = hill_constants(position, np.array([velocity[0], -2 * RATE * position[0], velocity[2]]), RATE)
    assert still.is_bounded()
    assert still.drift_m_rev == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(ValueError, match="above zero"):
        hill_constants(position, velocity, 0.0)


def test_a_free_body_turns_as_integration_says(rng):
    for size, span in ((0.01, 4.0), (0.5, 1.0), (2.0, 5.0)):
        rate = size * rng.normal(size=3)
        times = np.array([0.0, span])
        rotations, rates = scenes.spin(times, Rotation.identity(), rate, scenes.INERTIA)
        turned = turn_on(rate[None], scenes.INERTIA, span)
        off = Rotation.from_matrix(turned.turns[0]).inv() * rotations[-1]
        assert off.magnitude() < 3e-5 * max(1.0, size * span)
        assert turned.rates_rad_s[0] == pytest.approx(rates[-1], abs=3e-5 * size)


def test_gravity_turns_a_body_towards_the_vertical(rng):
    """The torque of the reference, integrated in inertial space with the vertical going round."""
    start, rate = Rotation.random(random_state=3), rng.normal(0, 1e-3, 3)

    def torque(t, inertial_from_body):
        up = inertial_from_body.inv().apply([np.cos(RATE * t), np.sin(RATE * t), 0.0])
        return 3 * RATE**2 * np.cross(up, scenes.INERTIA * up)

    times = np.array([0.0, 300.0])
    rotations, rates = scenes.spin(times, start, rate, scenes.INERTIA, torque)
    exact = start.inv() * rotations[-1]
    for n, is_near in ((RATE, True), (0.0, False)):  # an orbit that is not known pulls nobody
        camera = CameraCraft(
            n, lambda t, n=n: Rotation.from_rotvec([0, 0, n * t]).as_matrix()
        )  # it keeps still
        bank = MotionBank.at(1, Pose(start.as_matrix(), np.array([0.0, 0, 5.0])), np.eye(6))
        bank.states[:, SPIN] = rate
        bank.predict(camera, scenes.INERTIA, 0.0, 300.0, np.zeros((1, 3)))
        turned = start.inv() * Rotation.from_matrix(bank.pose(0).camera_from_body)
        off_rad = (turned.inv() * exact).magnitude()
        assert off_rad < 3e-5 if is_near else off_rad > 1e-3
        assert (bank.states[0, SPIN] == pytest.approx(rates[-1], abs=1e-7)) == is_near


@pytest.mark.parametrize("inertia", [scenes.INERTIA, None])
@pytest.mark.parametrize("size", [0.02, 0.4])
def test_errors_of_a_motion_go_on_as_differences_say(rng, inertia, size):
    tilt = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    craft = CameraCraft(
        RATE, lambda t: Rotation.from_rotvec([0, 0, 0.01 * t]).as_matrix() @ tilt, np.array([0.1, 0.2, 0.3])
    )
    members = some_members(rng, 1, size)
    members.covariances[:] = 0.0

    def after(step):
        bank = members.copy()
        (row,) = bank.states
        row[ROTATION] = (Rotation.from_rotvec(step[3:6]).as_matrix() @ row[ROTATION].reshape(3, 3)).ravel()
        row[PLACE] += step[:3]
        row[SPEED] += step[6:9]
        row[SPIN] += step[9:12]
        row[PULL] += step[12:]
        bank.predict(craft, inertia, 10.0, 12.0, np.zeros((1, 3)))
        return bank.states[0]

    found = np.empty((15, 15))
    for k in range(15):
        step = np.zeros(15)
        step[k] = 1e-6
        plus, minus = after(step), after(-step)
        turned = Rotation.from_matrix(plus[ROTATION].reshape(3, 3) @ minus[ROTATION].reshape(3, 3).T)
        found[:, k] = (
            np.r_[
                plus[PLACE] - minus[PLACE],
                turned.as_rotvec(),
                plus[SPEED] - minus[SPEED],
                plus[SPIN] - minus[SPIN],
                plus[PULL] - minus[PULL],
            ]
            / 2e-6
        )
    # the torque's change with the attitude is left out: 3 n^2 over the span
    for k in range(15):
        members.covariances[:] = 0.0
        members.covariances[0, k, k] = 1.0
        bank = members.copy()
        bank.predict(craft, inertia, 10.0, 12.0, np.zeros((1, 3)))
        expected = np.outer(found[:, k], found[:, k])
        assert bank.covariances[0] == pytest.approx(expected, abs=0.01 if size > 0.1 else 1e-3)


def some_members(rng, count, size=0.4):
    """Members that differ in everything."""
    bank = MotionBank.at(count, Pose(np.eye(3), np.array([0.5, -0.2, 6.0])), np.eye(6))
    for row, covariance in zip(bank.states, bank.covariances, strict=True):
        row[ROTATION] = Rotation.random(random_state=rng.integers(1000)).as_matrix().ravel()
        row[PLACE] += rng.normal(0, 0.1, 3)
        row[SPEED], row[PULL] = rng.normal(0, 0.01, 3), rng.normal(0, 1e-4, 3)
        row[SPIN] = size * rng.normal(size=3)
        root = rng.normal(0, 0.1, (15, 15))
        covariance[:] = root @ root.T
    return bank


def as_motions(bank):
    """The same for the NumPy twin."""
    rows = bank.states
    return oracle.Motions(
        rows[:, ROTATION].reshape(-1, 3, 3), rows[:, PLACE], rows[:, SPEED], rows[:, SPIN], rows[:, PULL]
    )


def is_the_same(bank, motions, covariances):
    found = as_motions(bank)
    for name in ("rotation", "position_m", "velocity_m_s", "rate_rad_s", "acceleration_m_s2"):
        assert getattr(found, name) == pytest.approx(getattr(motions, name), rel=1e-9, abs=1e-11), name
    assert bank.covariances == pytest.approx(covariances, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize(("count", "numbers"), [(0, 21), (17, 21), (7, 20)])
def test_members_that_the_core_has_no_room_for_are_refused(count, numbers):
    with pytest.raises(ValueError, match="at most 16"):
        MotionBank(np.zeros((count, numbers)), np.zeros((count, 15, 15)))


@pytest.mark.parametrize("inertia", [scenes.INERTIA, None])
@pytest.mark.parametrize("orbital_rate", [0.0, RATE])
@pytest.mark.parametrize("span_s", [0.033, 3.0])
def test_the_core_carries_members_as_numpy_does(rng, inertia, orbital_rate, span_s):
    craft = CameraCraft(
        orbital_rate,
        lambda t: Rotation.from_rotvec([0.02 * t, 0.1, 0]).as_matrix(),
        np.array([0.1, 0.2, 0.3]),
    )
    bank = some_members(rng, 7)
    densities = np.exp(rng.normal(0, 1, (7, 3)))
    motions, carried = oracle.advance(as_motions(bank.copy()), craft, inertia, 5.0, 5.0 + span_s)
    noise = oracle.noise_over(
        motions, oracle.Unmodelled(*densities.T), craft.camera_from_orbital(5.0 + span_s), span_s
    )
    expected = carried @ bank.covariances @ carried.transpose(0, 2, 1) + noise
    bank.predict(craft, inertia, 5.0, 5.0 + span_s, densities)
    is_the_same(bank, motions, expected)


def test_the_core_takes_a_frame_as_numpy_does(rng):
    bank = some_members(rng, 7)
    rows = rng.normal(0, 5, (12, 6))
    for row in bank.states:
        row[ROTATION] = (
            Rotation.from_rotvec(rng.normal(0, 0.1, 3)).as_matrix() @ bank.states[0, ROTATION].reshape(3, 3)
        ).ravel()
    frame = FrameInformation(bank.pose(0), rows.T @ rows, rows.T @ rng.normal(0, 1, 12), 11.0)
    motions, covariances, likelihood = oracle.update(as_motions(bank.copy()), bank.covariances.copy(), frame)
    assert bank.update(frame) == pytest.approx(likelihood, rel=1e-9)
    is_the_same(bank, motions, covariances)


def test_a_camera_on_a_turning_craft_sees_what_flies_straight_turn(rng):
    """Against a simulation in inertial space: nobody turns but the camera's craft."""
    craft = CameraCraft(RATE, lambda _t: np.eye(3))
    bank = MotionBank.at(1, Pose(np.eye(3), np.array([0.0, 0, 5.0])), np.eye(6))
    bank.predict(craft, None, 0.0, 100.0, np.zeros((1, 3)))
    expected = Rotation.from_rotvec([0, 0, -RATE * 100.0])  # the orbital frame turns on by +n about z
    assert bank.pose(0).camera_from_body == pytest.approx(expected.as_matrix(), abs=1e-12)


def test_the_precession_of_the_published_stage():
    """Reference 0.2 item 12: alpha 72.64 deg, psi' -1.4817 deg/s as printed, +1.4817 about the momentum."""
    inertia, rate = AxialInertia(2548.0, 14406.0), np.deg2rad([-2.5, 1.0, 1.0])
    found = precession_of(rate, inertia)
    assert np.degrees(found.half_angle_rad) == pytest.approx(72.63729708902619)
    assert np.degrees(found.published_rate_rad_s) == pytest.approx(-1.4817288500345671)
    assert np.degrees(found.rate_rad_s) == pytest.approx(1.4817288500345662)
    assert np.degrees(found.axis_angle_rad) == pytest.approx(180.0 - 72.63729708902619)
    times = np.array([0.0, 0.5, 20.0, 200.0])
    exact, rates = scenes.spin(
        times, Rotation.random(random_state=1), rate, np.array([2548.0, 14406.0, 14406.0])
    )
    ours = precess(exact[0].as_matrix(), rate, inertia, times)
    for k in range(4):
        assert ours[k] == pytest.approx(exact[k].as_matrix(), abs=1e-7)
        assert rate_after(rate, inertia, times[k]) == pytest.approx(rates[k], abs=1e-8)
    with pytest.raises(ValueError, match="no body"):
        AxialInertia(3.0, 1.0)
    with pytest.raises(ValueError, match="does not turn"):
        precession_of(np.zeros(3), inertia)


def test_pictures_of_a_bounded_and_of_a_wandering_orbit_say_which_they_are():
    position = np.array([2.0, 0.0, 0.0])
    for speed, words in ((-2.0 * RATE * 2.0, "bounded"), (0.0, "wanders")):
        figure = draw_relative_orbit(position, np.array([0.0, speed, 0.0]), RATE, 2.0)
        assert words in figure.axes[0].get_title()
