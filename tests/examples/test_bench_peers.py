"""What the benches compare us with must be right, or the comparison flatters us."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.fusion.estimator import PlanarState
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.published_motion import joint

STEP = 1e-6


def derivative(function, x):
    return np.column_stack(
        [(function(x + STEP * way) - function(x - STEP * way)) / (2 * STEP) for way in np.eye(len(x))]
    )


@pytest.fixture
def planar(bench):
    return bench("fusion.planar")


@pytest.fixture
def noise():
    return NoiseModel(
        packet_period_s=0.01,
        gyro_density_rad_s_rthz=6e-5,
        acc_density_m_s2_rthz=7e-5,
        star_sigma_xy_m=1e-3,
        star_sigma_heading_rad=1e-3,
        imu_offset_x_m=0.03,
        imu_offset_y_m=-0.02,
    )


@pytest.fixture
def state():
    rng = np.random.default_rng(1)
    return rng.normal(size=11) * (1.0, 0.1, 0.1, 1.0, 1.0, 0.01, 0.05, 0.05, 0.01, 0.01, 0.01)


@pytest.fixture
def readings(planar):
    rng = np.random.default_rng(2)
    return [
        planar.Reading(0.01 * i, 0.01, 0.5 + 0.1 * rng.normal(), *(0.05 * rng.normal(size=2)))
        for i in range(65)
    ]


def test_the_peers_derivatives_are_those_of_their_model(planar, noise, state, readings):
    first = readings[0]
    for function, claimed, tolerance in (
        (lambda x: planar.moved(x, first), planar.transition(state, first), 1e-4),  # first order in 10 ms
        (lambda x: planar.pose_of(x, noise), planar.pose_jacobian(state, noise), 1e-8),
        (planar.at_rest, planar.at_rest_jacobian(state), 1e-8),
    ):
        np.testing.assert_allclose(claimed, derivative(function, state), atol=tolerance)


def test_a_stretch_moves_as_its_readings_do_and_knows_its_derivatives(bench, planar, noise, state, readings):
    stretch, after = bench("fusion.preintegration").Stretch(state, noise), state
    for reading in readings:
        stretch.move(reading)
        after = planar.moved(after, reading)
    predicted, by = stretch.predict(state)
    np.testing.assert_allclose(predicted, after, atol=1e-12)
    np.testing.assert_allclose(by, derivative(lambda x: stretch.predict(x)[0], state), atol=1e-8)


def test_a_stretch_spreads_as_its_readings_noise_does(bench, planar, noise, state, readings):
    Stretch = bench("fusion.preintegration").Stretch  # noqa: N806 - a class
    rng, ends = np.random.default_rng(3), []
    noise = replace(noise, packet_period_s=0.05)
    coarse = [reading._replace(dt_s=0.05) for reading in readings[::5]]
    sigma = np.array([noise.gyro_density_rad_s_rthz, *(planar.KNOCKS * noise.acc_density_m_s2_rthz,) * 2])
    for _ in range(150):
        stretch = Stretch(state, noise)
        for reading in coarse:
            shaken = np.array(reading[2:]) + rng.normal(size=3) * sigma / np.sqrt(reading.dt_s)
            stretch.move(planar.Reading(reading.end_s, reading.dt_s, *shaken))
        ends.append(stretch.predict(state)[0][:5])
    claimed = stretch.covariance(float(state[0]))[:5, :5]
    whitened = (np.array(ends) - np.mean(ends, axis=0)) @ np.linalg.inv(np.linalg.cholesky(claimed)).T
    assert np.std(whitened, axis=0) == pytest.approx(1.0, abs=0.23)  # four sigma of 150


def test_a_pose_is_found_among_matches_of_which_some_are_wrong(bench):
    rng = np.random.default_rng(4)
    q = rng.normal(size=30) + 1j * rng.normal(size=30)
    goal = (1.5 - 0.5j) + np.exp(0.7j) * q
    goal[:4] += 0.5
    assert bench("star.rigid").rigid_pose(q, goal) == pytest.approx((1.5, -0.5, 0.7))


def test_a_fix_counts_as_found_only_near_the_truth_and_as_false_without_a_ceiling(bench):
    frame, score = bench("star.laboratory").Frame, bench("star.score").Score()
    image = np.zeros((8, 8), np.uint8)
    seen, dark = frame("easy", image, (1.0, 2.0, 3.1)), frame("dark", image, None)
    for which, answer in (
        (seen, (1.003, 2.004, 3.1 - 2 * np.pi)),  # headings meet at a full turn
        (seen, (1.03, 2.0, 3.1)),
        (seen, None),
        (dark, None),
        (dark, (0.0, 0.0, 0.0)),
    ):
        score.take(which, answer, 0.2, 1.0, 2.0)
    assert score.rate("easy") == pytest.approx(100 / 3)
    assert score.position_mm("easy") == pytest.approx(5.0)
    assert score.heading_deg("easy") == pytest.approx(0.0, abs=1e-9)
    assert score.false == 2
    assert score.dark_ms == [3.0, 3.0]


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(Path(__file__).parents[2] / "tools"))
        import fusion_truth

        folder = tmp_path_factory.mktemp("flight")
        lab = fusion_truth.Laboratory(scenario="perimeter", seed=7, duration_s=32.0, wrong_share=0.15)
        fusion_truth.write(fusion_truth.make(lab), folder)
    return folder


def test_the_truth_judged_by_itself_has_no_error(bench, flight):
    data = read_folder(flight)
    truth = np.genfromtxt(flight / "truth.csv", delimiter=",", names=True)
    columns = [
        np.interp(data.imu[:, 0], truth["t_s"], truth[name])
        for name in ("x_m", "y_m", "heading_rad", "vx_m_s", "vy_m_s")
    ]
    rows = np.column_stack(columns).tolist()
    states = [PlanarState(0, *row, 0.0, 0.0, 0.0, 0.0, 1e-3, 1e-3, 1e-3, False) for row in rows]
    found = bench("fusion.score").judge(flight, data, states, [])
    assert found.position_mm == found.velocity_mm_s == found.heading_deg == 0.0
    assert found.inside_place.tolist() == found.inside_heading.tolist() == [1.0, 1.0, 1.0]
    late = [None if i % 2 else state for i, state in enumerate(states)]
    assert bench("fusion.score").judge(flight, data, late, []).packets_without > 500


def test_wrong_fixes_are_taken_out_for_the_published_method_and_it_flies_better(bench, flight):
    flown = bench("fusion.score").flown
    spoilt = flown(flight, joint)
    cleaned = flown(flight, joint, is_cleaned=True)
    assert spoilt.wrong > cleaned.wrong == 0
    assert cleaned.position_mm < spoilt.position_mm


@pytest.mark.slow
@pytest.mark.parametrize(
    ("library", "module", "name"),
    [("filterpy", "filterpy_peer", "FilterpyPeer"), ("gtsam", "gtsam_peer", "GtsamPeer")],
)
def test_a_peer_flies_among_faults_to_a_few_millimetres(bench, flight, library, module, name):
    pytest.importorskip(library)
    found = bench("fusion.score").flown(flight, getattr(bench(f"fusion.{module}"), name))
    assert found.packets_without == 0
    assert found.position_mm < 4.0
    assert found.heading_deg < 0.1
