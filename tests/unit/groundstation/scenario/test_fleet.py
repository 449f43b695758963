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


FLEET = """
name = "who leads"
rig = "{rig}"
duration_s = 10.0
"""
RIG = (SCENARIOS.parent / "rigs" / "five_mock_ups.toml").as_posix()
FOLLOWS = """
[vehicles.{name}.control]
controller = "follow"
parameters = {{ leader = "{leader}", distance_m = 0.8 }}
"""


def fleet_of(tmp_path, text):
    path = tmp_path / "fleet.toml"
    path.write_text(FLEET.format(rig=RIG) + text)
    return path


@pytest.mark.parametrize(
    ("leaders", "circle"),
    [
        ({"alpha": "beta", "beta": "alpha"}, "alpha follows beta, beta follows alpha: nobody leads"),
        (
            {"alpha": "beta", "beta": "gamma", "gamma": "alpha"},
            "alpha follows beta, beta follows gamma, gamma follows alpha: nobody leads",
        ),
        (
            {"alpha": "beta", "beta": "gamma", "gamma": "delta", "delta": "epsilon", "epsilon": "beta"},
            "beta follows gamma, gamma follows delta, delta follows epsilon, epsilon follows beta: nobody",
        ),
    ],
)
def test_who_follows_its_follower_is_refused_with_file_and_key(tmp_path, leaders, circle):
    text = "".join(FOLLOWS.format(name=name, leader=leader) for name, leader in leaders.items())
    path = fleet_of(tmp_path, text)
    with pytest.raises(ScenarioError) as raised:
        load(path)
    said = str(raised.value)
    assert said.startswith(str(path))
    assert f".control.parameters: {circle}" in said
    assert "\n" not in said


@pytest.mark.parametrize("leader", ["beta", "omega"])
def test_a_leader_that_is_no_other_vehicle_is_refused_with_file_and_key(tmp_path, leader):
    path = fleet_of(tmp_path, FOLLOWS.format(name="beta", leader=leader))
    with pytest.raises(ScenarioError) as raised:
        load(path)
    said = str(raised.value)
    assert said.startswith(str(path))
    assert f"vehicles.beta.control.parameters: '{leader}' is no other vehicle of the rig" in said


def test_a_chain_and_a_circle_of_formations_that_one_leads_are_right(tmp_path):
    chain = {"beta": "alpha", "gamma": "beta", "delta": "gamma", "epsilon": "delta"}
    load(fleet_of(tmp_path, "".join(FOLLOWS.format(name=name, leader=each) for name, each in chain.items())))
    mutual = """
[vehicles.alpha.control]
controller = "formation"
parameters = { neighbours = { beta = { offset_m = [-0.8, 0.0] } } WEIGHT }
[vehicles.beta.control]
controller = "formation"
parameters = { neighbours = { alpha = { offset_m = [0.8, 0.0] } } }
"""
    load(fleet_of(tmp_path, mutual.replace("WEIGHT", ", goal_weight = 1.0")))
    with pytest.raises(ScenarioError, match="nobody leads"):
        load(fleet_of(tmp_path, mutual.replace("WEIGHT", "")))


def test_a_corridor_that_leads_over_the_edge_is_refused_with_file_and_key(tmp_path):
    text = (
        (SCENARIOS / "dock_still.toml").read_text().replace("../rigs", (SCENARIOS.parent / "rigs").as_posix())
    )
    path = tmp_path / "dock.toml"
    start = next(line for line in text.splitlines() if line.startswith("start") and "0.2" in line)
    path.write_text(text.replace(start, "start = { x_m = 1.6, y_m = 0.1, heading_deg = -90.0 }"))
    with pytest.raises(ScenarioError) as raised:
        load(path)
    said = str(raised.value)
    assert said.startswith(str(path))
    assert (
        "vehicles.beta.control.parameters.axis_deg: the gate of the corridor to alpha would lie at (2."
        in said
    )
    assert "outside the part of the table" in said
