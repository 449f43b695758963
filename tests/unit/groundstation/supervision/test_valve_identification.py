"""Thrust and dead time learned in flight by the mock-up of conftest: true sigmas, and what is not known."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from groundstation.supervision.valve_estimate import IdentificationConfig
from groundstation.supervision.valve_identification import ValveIdentification


class Fed:
    """What `fly` feeds: a detector that finds nothing."""

    def __init__(self, identification):
        self.command = identification.command
        self._sample = identification.sample

    def sample(self, *readings):
        self._sample(*readings)
        return False


def learned(air, rng, truth, chosen, identification=None):
    noise = air.DEFAULT
    identification = identification or ValveIdentification(
        air.MODEL,
        IdentificationConfig(
            imu_position_body_m=air.ARM_M,
            gyro_density_rad_s_rthz=noise["gyro"],
            acc_density_m_s2_rthz=noise["acc"],
        ),
    )
    for _ in air.fly(Fed(identification), rng, truth, chosen):
        raise AssertionError
    return identification


def drawn(air, rng):
    """A mock-up whose valves differ in their delays, too."""
    truth = air.Truth.drawn(rng)
    truth.open_ms = rng.uniform(5.0, 7.0) + rng.normal(0.0, 0.5, 8)
    truth.close_ms = rng.uniform(4.0, 6.0) + rng.normal(0.0, 0.5, 8)
    return truth


def true_values(air, truth):
    """Thrust over mass, torque over inertia, both over the rig's, dead time (s); each (8,)."""
    table = air.MODEL.effectiveness()
    x, y = truth.centre_m
    torque = (table[2] - x * table[1] + y * table[0]) * truth.gains
    dead_s = np.broadcast_to(1e-3 * (truth.open_ms - truth.close_ms), 8)
    return truth.gains / truth.mass, torque / table[2] / truth.inertia, dead_s


@pytest.mark.slow
def test_errors_of_fifty_mock_ups_are_as_large_as_their_sigmas_say(air):
    """Half a minute of flight each; also that half a minute is enough to know something."""
    squares = {"thrust_over_mass": [], "torque_over_inertia": [], "dead_time_s": []}
    sigmas = {name: [] for name in squares}
    for seed in range(50):
        rng = np.random.default_rng(seed)
        truth = drawn(air, rng)
        estimates = learned(air, rng, truth, air.commands(rng, 300, truth)).estimates()
        for name, wanted in zip(squares, true_values(air, truth), strict=True):
            found = [getattr(estimate, name) for estimate in estimates]
            assert None not in found
            errors = np.array([one.value for one in found]) - wanted
            sigma = np.array([one.sigma for one in found])
            squares[name] += (np.square(errors / sigma)).tolist()
            sigmas[name] += sigma.tolist()
    # valves of a mock-up share sag, lever and zeros: half of their number are taken to be independent
    low, high = chi2.ppf([0.0005, 0.9995], 200) / 200
    for name, found in squares.items():
        assert low < np.mean(found) < high, name
        assert max(found) < 5.0**2, name
    assert np.median(sigmas["thrust_over_mass"]) < 0.012
    assert np.median(sigmas["torque_over_inertia"]) < 0.02
    assert np.median(sigmas["dead_time_s"]) < 2.2e-4


def test_a_valve_that_is_never_opened_stays_unknown(air):
    rng = np.random.default_rng(5)
    truth = drawn(air, rng)
    chosen = air.commands(rng, 100, truth)
    chosen[:, 3] = 0
    estimates = learned(air, rng, truth, chosen).estimates()
    never = estimates[3]
    assert (never.thrust_over_mass, never.torque_over_inertia, never.dead_time_s) == (None, None, None)
    assert never.open_s == 0.0
    assert all(estimate.thrust_over_mass for estimate in estimates if estimate is not never)


def test_pulses_of_one_length_do_not_tell_thrust_from_dead_time(air):
    rng = np.random.default_rng(6)
    truth = drawn(air, rng)
    chosen = np.zeros((60, 8), dtype=int)
    chosen[::4, 0] = chosen[2::4, 2] = 35
    first = learned(air, rng, truth, chosen).estimates()[0]
    assert first.dead_time_s is None or first.dead_time_s.sigma > 2.5e-4


def test_a_mass_that_is_wrong_looks_like_valves_that_all_are(air):
    rng = np.random.default_rng(7)
    truth = air.Truth(gains=np.ones(8), mass=1.1, inertia=0.9)
    estimates = learned(air, rng, truth, air.commands(rng, 150, truth)).estimates()
    thrust = [estimate.thrust_over_mass for estimate in estimates]
    torque = [estimate.torque_over_inertia for estimate in estimates]
    assert [one.value for one in thrust] == pytest.approx([1.0 / 1.1] * 8, abs=0.05)
    assert [one.value for one in torque] == pytest.approx([1.0 / 0.9] * 8, abs=0.08)


def test_a_shock_is_set_aside(air):
    rng = np.random.default_rng(8)
    truth = air.Truth(gains=np.ones(8), push=(5000.0, 5060.0, 3.0, 2.0))
    identification = learned(air, rng, truth, air.commands(rng, 150, truth))
    assert 3 <= identification.set_aside <= 8
    for estimate in identification.estimates():
        assert estimate.thrust_over_mass.value == pytest.approx(1.0, abs=0.05)


def test_a_valve_that_changed_is_learned_anew(air):
    rng = np.random.default_rng(9)
    healthy = air.Truth(gains=np.ones(8))
    identification = learned(air, rng, healthy, air.commands(rng, 100, healthy))
    assert identification.estimates()[2].thrust_over_mass.value == pytest.approx(1.0, abs=0.05)
    identification.forget(2)
    assert identification.estimates()[2].thrust_over_mass is None
    identification.start()
    weak = air.Truth(gains=np.where(np.arange(8) == 2, 0.6, 1.0))
    learned(air, rng, weak, air.commands(rng, 100, weak), identification)
    found = identification.estimates()
    assert found[2].thrust_over_mass.value == pytest.approx(0.6, abs=0.06)
    assert found[3].thrust_over_mass.value == pytest.approx(1.0, abs=0.05)


def test_samples_with_holes_are_left_out(air):
    identification = learned(
        air, np.random.default_rng(1), air.Truth(gains=np.ones(8)), np.zeros((2, 8), dtype=int)
    )
    before = identification.estimates()
    assert not identification.sample(10**9, 0.004, math.nan, (0.0, 0.0))
    assert not identification.sample(10**9, 0.004, 0.0, (0.0, math.inf))
    assert identification.estimates() == before
