"""Ways of least gas and of least time, against linear programming and the bang-bang limit."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from groundstation.control.authority import Authority, authority_along
from groundstation.control.coasting import fastest, least_gas
from groundstation.control.fastest_way import BRAKE_SHARE, PUSH_SHARE, fastest_acceleration
from groundstation.control.go_to import GoTo, GoToConfig
from groundstation.control.state import Goal
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.control.wrench_envelope import WrenchEnvelope

VEHICLE = VehicleModel(11.0, 0.25, square_of_eight())
PUSH_M_S2 = 0.036


def programmed(distance_m, duration_s, pull_m_s2, slices=400):
    """Authority: the least integral of |u| by a linear programme over slices of constant push, m/s."""
    dt_s = duration_s / slices
    left_s = duration_s - (np.arange(slices) + 0.5) * dt_s
    rows = np.vstack([np.full(slices, dt_s), left_s * dt_s])
    wanted = (-pull_m_s2 * duration_s, distance_m - 0.5 * pull_m_s2 * duration_s**2)
    found = linprog(
        np.full(2 * slices, dt_s), A_eq=np.hstack([rows, -rows]), b_eq=wanted, bounds=(0.0, PUSH_M_S2)
    )
    return found.fun


@pytest.mark.parametrize("pull_m_s2", [0.0, 0.001, 0.005, -0.001, -0.005, -0.012])
@pytest.mark.parametrize("duration_s", [13.0, 20.0, 40.0])
def test_coasting_takes_what_the_linear_programme_takes_and_arrives_at_rest(pull_m_s2, duration_s):
    phases = least_gas(1.0, duration_s, PUSH_M_S2, pull_m_s2)
    assert phases.duration_s == pytest.approx(duration_s)
    way, speed, _ = phases.at(duration_s - 1e-9)
    assert way == pytest.approx(1.0, abs=1e-6)
    assert speed == pytest.approx(0.0, abs=1e-6)
    gas = sum(
        abs(acceleration - pull_m_s2) * span_s
        for acceleration, span_s in zip(phases.accelerations_m_s2, phases.spans_s, strict=True)
    )
    assert gas == pytest.approx(programmed(1.0, duration_s, pull_m_s2), rel=0.01)
    pushes = [acceleration - pull_m_s2 for acceleration in phases.accelerations_m_s2]
    assert max(map(abs, pushes)) <= PUSH_M_S2 * (1 + 1e-9)


def test_too_short_a_time_gets_the_fastest_way():
    assert least_gas(1.0, 5.0, PUSH_M_S2, 0.003) == fastest(1.0, PUSH_M_S2, 0.003)
    # uphill on the way, downhill for the brakes: half of each square
    assert fastest(1.0, 0.04, 0.0).duration_s == pytest.approx(2.0 * math.sqrt(1.0 / 0.04))


def test_a_slope_that_the_valves_cannot_hold_is_refused():
    with pytest.raises(ValueError, match="cannot hold"):
        least_gas(1.0, 20.0, 0.01, -0.01)


def test_two_valves_push_along_a_face_and_four_along_a_diagonal():
    envelope = WrenchEnvelope(VEHICLE)
    face = authority_along((1.0, 0.0), 0.0, (-0.003, 0.001), VEHICLE, envelope)
    assert face == pytest.approx((0.04, 0.04, -0.003))
    assert (face.accelerating(1.0), face.braking(1.0)) == pytest.approx((0.037, 0.043))
    corner = authority_along((1.0, 0.0), math.pi / 4, (0.0, 0.0), VEHICLE, envelope)
    assert corner.forwards_m_s2 == pytest.approx(0.04 * math.sqrt(2.0))
    assert authority_along((1.0, 0.0), None, (0.0, 0.0), VEHICLE, envelope).forwards_m_s2 == pytest.approx(
        0.04
    )


class HeldFirst:
    """A law that is sent away after it has held its start: by then it knows the slope."""

    HELD_S = 12.0

    def __init__(self, law):
        self._law, self._t_s = law, 0.0

    def update(self, state, goal, dt_s, **more):
        self._t_s += dt_s
        return self._law.update(
            state, goal if self._t_s > self.HELD_S else Goal((0.0, 0.0), 0.0), dt_s, **more
        )


@pytest.mark.parametrize("slope_m_s2", [0.0, 0.005, -0.005])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_fast_way_takes_hardly_longer_than_bang_bang_and_does_not_overshoot(fly, world, slope_m_s2, seed):
    """Up and down 0.5 mrad, weak valves, the harsh estimate of conftest without its jumps."""
    quiet = world(
        slope_table_m_s2=(slope_m_s2, 0.0), fix_sigma_m=0.0, speed_sigma_m_s=0.0, rate_noise_sigma_rad_s=0.0
    )
    law = HeldFirst(GoTo(GoToConfig(profile="time"), VEHICLE))
    flight = fly(law, Goal((1.0, 0.0), 0.0), world=quiet, duration_s=42.0, averaged=True, seed=seed)
    t_s, x = np.array(flight.time_s) - HeldFirst.HELD_S, np.array(flight.pose)[:, 0]
    limit_s = fastest(1.0, 0.04, slope_m_s2).duration_s
    settled = np.flatnonzero(np.abs(x - 1.0) > 0.010)
    assert t_s[settled[-1]] < 1.2 * limit_s
    assert x.max() < 1.0 + 0.010


def test_the_fastest_push_is_full_then_on_the_curve_then_harder_for_who_is_too_fast():
    uphill = Authority(0.04, 0.04, -0.005)
    braking = BRAKE_SHARE * 0.04 + 0.005
    full = fastest_acceleration((1.0, 0.0), (0.0, 0.0), uphill, 0.25)
    assert full == pytest.approx((PUSH_SHARE * 0.04 - 0.005, 0.0))
    on_curve = math.sqrt(2.0 * braking * 0.2)
    assert fastest_acceleration((0.2, 0.0), (on_curve, 0.0), uphill, 0.25) == pytest.approx((-braking, 0.0))
    faster, _ = fastest_acceleration((0.2, 0.0), (on_curve + 0.003, 0.0), uphill, 0.25)
    assert -0.045 < faster < -braking - 0.008
    far_too_fast, _ = fastest_acceleration((0.2, 0.0), (0.5, 0.0), uphill, 0.25)
    assert far_too_fast == pytest.approx(-0.045)  # all the valves, and the hill
    # at the stated speed nothing is asked for; what drifts aside is stopped
    assert fastest_acceleration((5.0, 0.0), (0.25, 0.0), uphill, 0.25) == pytest.approx((0.0, 0.0))
    assert fastest_acceleration((0.0, 5.0), (0.01, 0.25), uphill, 0.25)[0] < -0.02
    assert fastest_acceleration((0.0, 0.0), (0.1, 0.0), uphill, 0.25) == (0.0, 0.0)


@pytest.mark.parametrize("profile", ["limited", "time"])
def test_the_end_of_a_way_does_not_jump(fly, world, profile):
    """The reference brakes to the end: a jump of its speed would be left to the feedback."""
    law = GoTo(GoToConfig(profile=profile), VEHICLE)
    told = []
    original = law._reference

    def listening(state, goal, dt_s):
        told.append(original(state, goal, dt_s))
        return told[-1]

    law._reference = listening
    quiet = world(slope_table_m_s2=(0.0, 0.0), fix_sigma_m=0.0, speed_sigma_m_s=0.0)
    fly(law, Goal((0.6, 0.0), 0.0), world=quiet, duration_s=20.0)
    speeds = [goal.velocity_table_m_s[0] for goal in told]
    jumps = np.abs(np.diff(speeds))
    arrived = next(k for k, goal in enumerate(told) if goal.position_table_m == (0.6, 0.0))
    assert speeds[-1] == 0.0
    assert jumps[arrived - 5 : arrived + 1].max() < 0.005
    # and all of it is fed forward
    fed = np.cumsum([goal.acceleration_table_m_s2[0] for goal in told[: arrived + 1]]) * 0.02
    assert fed[-1] - fed[arrived - 6] == pytest.approx(speeds[arrived] - speeds[arrived - 6], abs=1e-6)


def test_a_way_of_least_gas_takes_its_time_and_hardly_more_gas_than_the_least(fly, world):
    quiet = world(
        slope_table_m_s2=(0.0, 0.0),
        disturbance_torque_nm=0.0,
        fix_sigma_m=0.0,
        speed_sigma_m_s=0.0,
        rate_noise_sigma_rad_s=0.0,
    )
    law = GoTo(GoToConfig(profile="gas", duration_s=20.0), VEHICLE)
    flight = fly(law, Goal((1.0, 0.0), 0.0), world=quiet, duration_s=22.0)
    pose = np.array(flight.pose)
    assert pose[-1, 0] == pytest.approx(1.0, abs=0.01)
    assert pose[100, 0] == pytest.approx(0.5, abs=0.03)
    least_n_s = 11.0 * programmed(1.0, 20.0, 0.0)
    assert flight.gas_n_s < 1.4 * least_n_s


def test_a_time_belongs_to_the_profile_of_least_gas():
    with pytest.raises(ValueError, match="duration_s goes with"):
        GoToConfig(duration_s=20.0)
