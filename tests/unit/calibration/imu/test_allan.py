import numpy as np
import pytest

from calibration.imu.allan import allan_deviation, overlapping_deviation, stretches_on_ticks

NBS_MONOGRAPH_140 = np.array([892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0])


def nbs_thousand() -> np.ndarray:
    """The 1000-point set of NIST SP 1065, section 12.4: a prime modulus congruential generator."""
    n = [1234567890]
    for _ in range(999):
        n.append(16807 * n[-1] % 2147483647)
    return np.array(n) / 2147483647.0


@pytest.mark.parametrize(("m", "published"), [(1, 91.22945), (2, 85.95287)])
def test_the_nine_point_set_of_nbs_monograph_140(m, published):
    found = overlapping_deviation([NBS_MONOGRAPH_140], np.array([m]))
    assert found[0] == pytest.approx(published, abs=5e-6)


@pytest.mark.parametrize(("m", "published"), [(1, 2.922319e-01), (10, 9.159953e-02), (100, 3.241343e-02)])
def test_the_thousand_point_set_of_nist_sp_1065(m, published):
    found = overlapping_deviation([nbs_thousand()], np.array([m]))
    assert found[0] == pytest.approx(published, rel=2e-7)


def test_it_agrees_with_allantools():
    allantools = pytest.importorskip("allantools")
    rate = np.random.default_rng(3).normal(size=5000)
    factors = np.array([1, 3, 10, 70, 500])
    _, theirs, _, _ = allantools.oadev(rate, rate=100.0, data_type="freq", taus=factors * 0.01)
    np.testing.assert_allclose(overlapping_deviation([rate], factors), theirs, rtol=1e-9)


def test_white_noise_gives_its_density_back():
    rng = np.random.default_rng(4)
    density = 1.2e-4
    found = allan_deviation([rng.normal(0.0, density / np.sqrt(0.01), 200_000)], 0.01)
    assert found.random_walk == pytest.approx(density, rel=0.03)
    assert not found.is_floor_seen or found.bias_instability < 0.1 * density


def test_a_wandering_bias_turns_the_curve_up():
    rng = np.random.default_rng(5)
    n = 200_000
    rate = rng.normal(0.0, 1e-3, n) + np.cumsum(rng.normal(0.0, 2e-6, n))
    found = allan_deviation([rate], 0.01)
    assert found.is_floor_seen
    assert 1.0 < found.bias_instability_tau_s < 100.0
    assert found.random_walk == pytest.approx(1e-4, rel=0.1)


def test_packets_stand_on_their_ticks_and_lost_ones_are_not_made_up():
    t = np.array([0.01, 0.02, 0.0501, 0.06])
    (out,), spacing_s = stretches_on_ticks(t, np.array([[1.0], [2.0], [5.0], [6.0]]), 0.01)
    np.testing.assert_array_equal(out[:, 0], [1, 2, np.nan, np.nan, 5, 6])
    assert spacing_s == pytest.approx(0.01, rel=1e-9)


def test_a_clock_that_is_a_little_fast_leaves_no_holes():
    t = np.arange(1, 20_001) * 0.01 * 1.005 + np.random.default_rng(6).normal(0.0, 3e-4, 20_000)
    (out,), spacing_s = stretches_on_ticks(t, np.ones((20_000, 1)), 0.01)
    assert len(out) == 20_000
    assert spacing_s == pytest.approx(0.01005, rel=1e-5)


@pytest.mark.parametrize("hole_s", [0.1, 20.0, 40_000.0])
@pytest.mark.parametrize("lost", [0.0, 0.1])
def test_holes_do_not_lower_the_noise(hole_s, lost):
    rng = np.random.default_rng(7)
    ratios, n = [], 6000
    for _ in range(20):
        t = np.arange(1, n + 1) * 0.01
        t[n // 3 :] += hole_s
        good = rng.uniform(size=n) >= lost
        values = rng.normal(0.0, 1e-3, (n, 1))
        stretches, spacing_s = stretches_on_ticks(t[good], values[good], 0.01)
        assert len(stretches) == (1 if hole_s < 1.0 else 2)
        found = allan_deviation([each[:, 0] for each in stretches], spacing_s)
        ratios.append((found.random_walk - 1e-4) / found.random_walk_sigma)
    assert abs(np.mean(ratios)) < 0.7  # 3 sigma of a mean of twenty
    assert 0.6 < np.std(ratios) < 1.4


@pytest.mark.parametrize("seconds", [8, 60, 600])
def test_white_noise_alone_never_shows_a_floor(seconds):
    rng = np.random.default_rng(8)
    for _ in range(20):
        found = allan_deviation([rng.normal(size=100 * seconds)], 0.01)
        assert not found.is_floor_seen
        assert found.tau_s[-1] <= 0.1 * seconds


def test_too_short_a_record_is_refused():
    with pytest.raises(ValueError, match="64"):
        allan_deviation([np.zeros(10)], 0.01)
