import numpy as np
import pytest

from calibration.imu.allan import allan_deviation, bridge_holes, overlapping_deviation

NBS_MONOGRAPH_140 = np.array([892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0])


def nbs_thousand() -> np.ndarray:
    """The 1000-point set of NIST SP 1065, section 12.4: a prime modulus congruential generator."""
    n = [1234567890]
    for _ in range(999):
        n.append(16807 * n[-1] % 2147483647)
    return np.array(n) / 2147483647.0


@pytest.mark.parametrize(("m", "published"), [(1, 91.22945), (2, 85.95287)])
def test_the_nine_point_set_of_nbs_monograph_140(m, published):
    found = overlapping_deviation(NBS_MONOGRAPH_140, 1.0, np.array([m]))
    assert found[0] == pytest.approx(published, abs=5e-6)


@pytest.mark.parametrize(("m", "published"), [(1, 2.922319e-01), (10, 9.159953e-02), (100, 3.241343e-02)])
def test_the_thousand_point_set_of_nist_sp_1065(m, published):
    found = overlapping_deviation(nbs_thousand(), 1.0, np.array([m]))
    assert found[0] == pytest.approx(published, rel=2e-7)


def test_it_agrees_with_allantools():
    allantools = pytest.importorskip("allantools")
    rate = np.random.default_rng(3).normal(size=5000)
    factors = np.array([1, 3, 10, 70, 500])
    _, theirs, _, _ = allantools.oadev(rate, rate=100.0, data_type="freq", taus=factors * 0.01)
    np.testing.assert_allclose(overlapping_deviation(rate, 0.01, factors), theirs, rtol=1e-9)


def test_white_noise_gives_its_density_back():
    rng = np.random.default_rng(4)
    density = 1.2e-4
    found = allan_deviation(rng.normal(0.0, density / np.sqrt(0.01), 200_000), 0.01)
    assert found.random_walk == pytest.approx(density, rel=0.03)
    assert not found.is_floor_seen or found.bias_instability < 0.1 * density


def test_a_wandering_bias_turns_the_curve_up():
    rng = np.random.default_rng(5)
    n = 200_000
    rate = rng.normal(0.0, 1e-3, n) + np.cumsum(rng.normal(0.0, 2e-6, n))
    found = allan_deviation(rate, 0.01)
    assert found.is_floor_seen
    assert 1.0 < found.bias_instability_tau_s < 100.0
    assert found.random_walk == pytest.approx(1e-4, rel=0.1)


def test_lost_packets_are_bridged_on_the_ticks():
    t = np.array([0.01, 0.02, 0.0501, 0.06])
    out = bridge_holes(t, np.array([[1.0], [2.0], [5.0], [6.0]]), 0.01)
    np.testing.assert_allclose(out[:, 0], [1, 2, 3, 4, 5, 6])


def test_too_short_a_record_is_refused():
    with pytest.raises(ValueError, match="64"):
        allan_deviation(np.zeros(10), 0.01)
