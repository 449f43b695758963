"""A fleet that flies one plan: what the rig states already, changed types, limits between all of them."""

from pathlib import Path

import pytest

from groundstation.control.controllers import controllers
from groundstation.control.trajectory_config import TrajectoryConfig
from groundstation.parts.control.sections import config_of, control_of, dockings_of, neighbours_of
from groundstation.scenario.compiling import groups_of
from groundstation.scenario.limits import expanded
from groundstation.scenario.loading import load
from groundstation.scenario.scenario_file import Limit, ScenarioError

SCENARIOS = Path(__file__).parents[4] / "examples" / "scenarios"
SWAP = (SCENARIOS / "five_ship_swap.toml").read_text()


@pytest.fixture(scope="module")
def swap():
    return load(SCENARIOS / "five_ship_swap.toml")


def test_a_changed_type_is_what_flies_and_waits_for_its_beginning(swap):
    for name in swap.rig.vehicles:
        section, _ = control_of(swap.rig, name)
        assert (section.controller, section.waits) == ("trajectory", True)
    assert set(swap.section.resumed) == set(swap.rig.vehicles)


def test_names_starts_and_places_to_keep_out_of_come_from_the_rig(swap):
    config = config_of(swap.rig, "gamma")
    assert isinstance(config, TrajectoryConfig)
    assert config.ship == "gamma"
    assert list(config.starts_m) == ["alpha", "beta", "gamma", "delta", "epsilon"]
    assert config.starts_m["beta"] == (-1.3, 0.8)
    assert neighbours_of(swap.rig, "gamma") == ("alpha", "beta", "delta", "epsilon")


def test_only_those_that_fly_it_are_of_the_fleet():
    rig = load(SCENARIOS / "three_ship_reconfiguration.toml").rig
    assert neighbours_of(rig, "alpha") == ("beta", "gamma")
    assert neighbours_of(rig, "delta") == ()


def test_a_limit_between_two_holds_for_every_pair_of_all(swap):
    limit = Limit(what="least_distance_mm", vehicle="all", above=50.0)
    pairs = expanded(limit, 0, groups_of(swap.rig))
    assert len(pairs) == 10
    assert ("alpha", "epsilon") in pairs


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[1.3, -0.8], [0.0", "[0.0", "5 ships need as many places, found 4: give more places"),
        ("duration_s = 74.0", "duration_s = 12.0", "no safe way was found within 12 s"),
        ("[0.0, -0.9]", "[0.0, -1.4]", "the goals are no places to rest at: ship 2 and the edge"),
        ("[0.0, -0.9]", "[1.2, -0.9]", "the goals are no places to rest at: ships 1 and 2"),
    ],
)
def test_a_plan_that_is_not_safe_is_refused_with_its_key(tmp_path, old, new, words):
    assert old in SWAP
    path = tmp_path / "swap.toml"
    path.write_text(SWAP.replace(old, new).replace("../rigs", (SCENARIOS.parent / "rigs").as_posix()))
    with pytest.raises(ScenarioError) as raised:
        load(path)
    assert "mock_ups.standard.control.parameters: " in str(raised.value)
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_pair_that_docks_is_found_in_the_rig():
    rig = load(SCENARIOS / "dock_still.toml").rig
    (docking,) = dockings_of(rig)
    assert (docking.ship, docking.target) == ("beta", "alpha")
    config = config_of(rig, "beta")
    assert docking.corridor == controllers()["dock"].docks_with(config)[1]


@pytest.mark.parametrize("target", ["beta", "gamma"])
def test_a_target_that_is_no_other_vehicle_is_refused(tmp_path, target):
    text = (SCENARIOS / "dock_still.toml").read_text()
    text = text.replace('target = "alpha"', f'target = "{target}"')
    path = tmp_path / "dock.toml"
    path.write_text(text.replace("../rigs", (SCENARIOS.parent / "rigs").as_posix()))
    with pytest.raises(ScenarioError, match=f"'{target}' is no other vehicle of the rig"):
        load(path)
