import numpy as np
import pytest

from calibration.imu.zero_offset import NotARest, zero_offset

OFFSET = np.array([-0.006, 0.035, -0.06])
SIGMA = np.array([7e-4, 6.4e-4, 6.4e-4])


def a_rest(seconds: float = 10.0, seed: int = 0):
    rng = np.random.default_rng(seed)
    n = round(seconds * 100)
    t = np.arange(1, n + 1) * 0.01
    return t, OFFSET + rng.normal(0.0, SIGMA, (n, 3)), np.full(n, 25.0)


def test_the_mean_of_a_rest_is_within_its_own_sigma_over_seeds():
    ratio = []
    for seed in range(40):
        t, readings, warmth = a_rest(seed=seed)
        found = zero_offset(t, readings, warmth)
        ratio.append((found.mean - OFFSET) / found.mean_sigma)
        assert not found.disturbances
    assert 0.6 < np.std(ratio) < 1.2


def test_the_noise_of_a_packet_is_found():
    t, readings, warmth = a_rest(60.0)
    np.testing.assert_allclose(zero_offset(t, readings, warmth).packet_sigma, SIGMA, rtol=0.05)


def test_quantised_readings_keep_their_noise():
    t, readings, warmth = a_rest(60.0)
    readings[:, 0] = np.round(readings[:, 0] / 4e-4) * 4e-4
    found = zero_offset(t, readings, warmth)
    assert found.packet_sigma[0] == pytest.approx(np.hypot(7e-4, 4e-4 / np.sqrt(12)), rel=0.06)


@pytest.mark.parametrize(
    ("start", "stop", "kind"),
    [(4.0, 4.06, "knock"), (4.0, 4.02, "knock"), (3.0, 5.0, "touch"), (4.0, 4.01, "wild packet")],
)
def test_a_disturbance_is_named_and_cut_out(start, stop, kind):
    t, readings, warmth = a_rest()
    rows = (t > start - 0.005) & (t < stop - 0.005)
    readings[rows, 1] += 0.2 if kind == "wild packet" else 0.05 * np.where(rows[rows], 1.0, 1.0)
    found = zero_offset(t, readings, warmth)
    assert [d.kind for d in found.disturbances] == [kind]
    assert found.disturbances[0].channel == "ax"
    assert found.disturbances[0].start_s == pytest.approx(start, abs=0.3)
    assert np.abs(found.mean - OFFSET).max() < 5 * (SIGMA / np.sqrt(len(t))).max()


def test_a_flight_is_not_a_rest():
    t, readings, warmth = a_rest()
    readings[:, 1] += 0.04 * (np.sin(3 * t) > 0.5)
    readings[300:, 2] += 0.02
    readings[600:, 2] -= 0.05
    with pytest.raises(NotARest, match="undisturbed"):
        zero_offset(t, readings, warmth)


def test_a_few_packets_are_not_a_rest():
    t, readings, warmth = a_rest(0.5)
    with pytest.raises(NotARest, match="needed"):
        zero_offset(t, readings, warmth)


def test_no_thermometer_is_no_obstacle():
    t, readings, warmth = a_rest()
    assert np.isnan(zero_offset(t, readings, warmth * np.nan).temperature_c)
