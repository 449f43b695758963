"""Drawn values: the same wherever run k is flown, independent of other keys, by the laws of the file."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.declarations.errors import UsageError
from groundstation.rig.variation import value_at
from groundstation.scenario.dispersions import draw, expanded_keys, laboratory_seed
from groundstation.scenario.loading import load
from groundstation.scenario.rehearsal import check_failures

RIG = Path(__file__).parents[4] / "examples/rigs/two_mock_ups_drawn.toml"
HEAD = f'name = "t"\nrig = "{RIG.as_posix()}"\nduration_s = 20.0\n[dispersions]\n'
RUNS = 2000


@pytest.fixture
def scenario(tmp_path):
    """Writes dispersions and reads the scenario."""

    def write(rows):
        path = tmp_path / "scenario.toml"
        path.write_text(HEAD + rows)
        return load(path)

    return write


def column(scenario, key, runs=RUNS, seed=1):
    return np.array([draw(scenario, seed, run)[key] for run in range(runs)])


def test_laws_have_their_moments(scenario):
    plan = scenario(
        '"laboratory.alpha.mass_kg" = { normal = [11.0, 0.2] }\n'
        '"laboratory.beta.mass_kg" = { uniform = [10.0, 12.0] }\n'
        '"vehicles.alpha.start.x_m" = { add_uniform = [-0.1, 0.1] }\n'
        '"vehicles.beta.hold.y_m" = { add_normal = [0.0, 0.05] }\n'
        '"laboratory.alpha.camera.rate_hz" = { choice = [5.0, 10.0] }\n'
    )
    mass = column(plan, "laboratory.alpha.mass_kg")
    assert mass.mean() == pytest.approx(11.0, abs=0.02)
    assert mass.std() == pytest.approx(0.2, rel=0.1)
    other = column(plan, "laboratory.beta.mass_kg")
    assert 10.0 <= other.min() < 10.02
    assert 11.98 < other.max() <= 12.0
    start = column(plan, "vehicles.alpha.start.x_m")  # about the pose that the rig holds
    assert start.mean() == pytest.approx(-0.5, abs=0.01)
    assert column(plan, "vehicles.beta.hold.y_m").mean() == pytest.approx(-0.1, abs=0.01)
    rates = column(plan, "laboratory.alpha.camera.rate_hz")
    assert set(rates) == {5.0, 10.0}
    assert np.mean(rates == 5.0) == pytest.approx(0.5, abs=0.05)
    assert abs(np.corrcoef(mass, other)[0, 1]) < 0.1


def test_a_place_of_a_list_is_drawn_by_its_number(scenario):
    plan = scenario(
        '"laboratory.table.tilt_rad.0" = { add_normal = [0.0, 1e-4] }\n'
        '"laboratory.table.tilt_rad.1" = { uniform = [-2e-4, 2e-4] }\n'
    )
    drawn = draw(plan, 1, 0)
    assert column(plan, "laboratory.table.tilt_rad.0", 200).mean() == pytest.approx(3e-4, abs=3e-5)
    assert value_at(plan.vary(drawn).rig, "laboratory.table.tilt_rad") == list(drawn.values())
    assert value_at(plan.rig, "laboratory.table.tilt_rad") == [3e-4, -1e-4]


def test_the_thrust_of_a_valve_is_drawn_where_the_rig_writes_it(scenario, tmp_path):
    thrusters = "".join(
        "[[laboratory.vehicles.thrusters]]\nposition_body_m = [0.1, 0.1]\ndirection_body = [1.0, 0.0]\n"
        for _ in range(8)
    )
    rig = tmp_path / "rig.toml"
    rig.write_text(RIG.read_text() + thrusters)
    scenario("")
    path = tmp_path / "scenario.toml"
    path.write_text(path.read_text().replace(RIG.as_posix(), rig.name))
    varied = load(path).vary({"laboratory.beta.thrusters.3.thrust_n": 0.2})
    assert value_at(varied.rig, "laboratory.beta.thrusters.3.thrust_n") == 0.2
    check_failures(varied)


def test_a_run_is_the_same_whatever_else_is_drawn_and_another_for_another_seed_or_run(scenario):
    row = '"laboratory.alpha.mass_kg" = { normal = [11.0, 0.2] }\n'
    alone = draw(scenario(row), 5, 3)
    beside = draw(scenario('"laboratory.beta.mass_kg" = { normal = [11.0, 0.2] }\n' + row), 5, 3)
    assert beside["laboratory.alpha.mass_kg"] == alone["laboratory.alpha.mass_kg"]
    values = {
        draw(scenario(row), seed, run)["laboratory.alpha.mass_kg"] for seed in (5, 6) for run in range(5)
    }
    assert len(values) == 10
    assert len({laboratory_seed(5, run) for run in range(1000)}) == 1000


def test_keys_of_one_common_name_draw_one_value(scenario):
    plan = scenario('"laboratory.*.mass_kg" = { normal = [11.0, 0.2], common = "mass" }\n')
    drawn = draw(plan, 1, 0)
    assert drawn["laboratory.alpha.mass_kg"] == drawn["laboratory.beta.mass_kg"]
    apart = draw(scenario('"laboratory.*.mass_kg" = { normal = [11.0, 0.2] }\n'), 1, 0)
    assert apart["laboratory.alpha.mass_kg"] != apart["laboratory.beta.mass_kg"]


def test_a_star_stands_for_names_in_their_order(scenario):
    plan = scenario('"vehicles.*.start.y_m" = { add_uniform = [-0.1, 0.1] }\n')
    assert [key for key, _ in expanded_keys(plan)] == ["vehicles.alpha.start.y_m", "vehicles.beta.start.y_m"]


def test_drawn_values_reach_scenario_rig_and_laboratory(scenario):
    plan = scenario(
        '"laboratory.alpha.mass_kg" = { uniform = [11.5, 11.5] }\n'
        '"mock_ups.standard.valves.thrust_n" = { uniform = [0.2, 0.2] }\n'
        '"laboratory.alpha.valves.spread" = { uniform = [0.1, 0.1] }\n'
        '"vehicles.alpha.start.x_m" = { add_uniform = [0.1, 0.1] }\n'
    )
    flown = plan.vary(draw(plan, 1, 0))
    assert value_at(flown.rig, "laboratory.alpha.mass_kg") == 11.5
    assert flown.rig.type_of("alpha").valves.thrust_n == 0.2
    assert value_at(flown.rig, "laboratory.alpha.valves.spread") == 0.1
    hold = flown.rig.vehicles["alpha"].hold
    assert (hold.x_m, hold.y_m) == (pytest.approx(-0.4), pytest.approx(0.1))
    assert value_at(flown.rig, "laboratory.alpha.start_m") == [pytest.approx(-0.4), pytest.approx(0.1)]


def test_a_varied_scenario_leaves_the_first_as_it_was(scenario):
    plan = scenario('"laboratory.alpha.mass_kg" = { uniform = [11.5, 11.5] }\n')
    plan.vary({"vehicles.alpha.start.x_m": 0.0, "duration_s": 5.0})
    assert plan.file.duration_s == 20.0
    assert plan.rig.vehicles["alpha"].hold.x_m == -0.5


def test_nested_keys_of_a_vehicles_laboratory_leave_the_others_as_they_are(tmp_path):
    path = tmp_path / "scenario.toml"
    path.write_text(
        HEAD.replace("[dispersions]", "[vehicles.alpha]") + "laboratory = { camera = { rate_hz = 3.0 } }\n"
    )
    plan = load(path)
    assert value_at(plan.rig, "laboratory.alpha.camera.rate_hz") == 3.0
    assert value_at(plan.rig, "laboratory.alpha.camera.source") == "fixes"


@pytest.mark.parametrize(
    ("row", "word"),
    [
        ('"vehicles.*.start.*" = { uniform = [0, 1] }', "'*' stands"),
        ('"laboratory.alpha.mass_kg" = { add_normal = [0, 1] }', "no number in the file"),
        ('"laboratory.alpha.imu.model" = { add_normal = [0, 1] }', "no number in the file"),
        ('"mock_ups.gone.mass_kg" = { add_normal = [0, 1] }', "no such table"),
    ],
)
def test_what_cannot_be_drawn_is_refused(scenario, row, word):
    with pytest.raises(UsageError, match=f"dispersions.*{word.replace('*', '.')}"):
        draw(scenario(row + "\n"), 1, 0)
