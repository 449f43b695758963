"""A table that is out of level and wavy, with its map and without: what the map is worth in flight."""

import importlib
import json
import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from drivers.laboratory import load_laboratory
from groundstation.fusion.table_map import MapProvenance, TableMap
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import FusionCalibration, FusionStatus, VehicleState
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.valves.messages import ValveDemand

EXAMPLES = Path(__file__).parents[2] / "examples"
SURFACE = "tilt_rad = [0.0003, -0.0001]"
WAVY = (SURFACE, f"{SURFACE}\nwaviness_rad = 5e-5\nwaviness_length_m = 0.8")
GOES = ("[vehicles.alpha]", '[mock_ups.standard.control]\ncontroller = "go_to"\n\n[vehicles.alpha]')
LEG_S, OUTAGE_S = 18.0, 10.0
POSES = ((1.0, -0.6, 0.8), (-1.0, -0.6, 1.6), (1.0, 0.7, 2.4), (-0.9, 0.8, 3.0))


def true_map(rig, seed, path):
    """Write the map that a perfect survey of the emulated table would have made."""
    surface = load_laboratory(rig.laboratory.name, rig.laboratory.table, seed).surface
    x, y = np.arange(-2.0, 2.01, 0.05), np.arange(-1.5, 1.51, 0.05)
    pull = np.array([[surface.slope_acceleration(a, b) for a in x] for b in y])
    sigma, mean = np.full(pull.shape[:2], 5e-5), pull.reshape(-1, 2).mean(axis=0)
    made = TableMap(
        -2.0, -1.5, 0.05, pull[..., 0], pull[..., 1], sigma, sigma, np.zeros_like(sigma),
        (float(mean[0]), float(mean[1])), 1e-9 * np.eye(2), 3e-4,
        MapProvenance(datetime(2026, 1, 1, tzinfo=UTC), {"truth": "0" * 64}, 1.0, 1.0),
    )  # fmt: skip
    made.save(path)


def tour(fly, legs, seed, table_map=None):
    """Fly from pose to pose, each leg with an outage of the sky.

    Returns:
        Distances of estimate and truth at the end of each outage (m), and the summed on-times of all valves.
    """
    table = [] if table_map is None else [("y_max_m = 1.5", f'y_max_m = 1.5\nmap = "{table_map}"')]
    begin_s = 4.0
    ends = [begin_s + LEG_S * leg + 6.0 + OUTAGE_S for leg in range(legs)]
    dark = "".join(
        '\n[[laboratory.faults]]\nkind = "dead_sky"\nvehicle = "alpha"\n'
        f"start_s = {end - OUTAGE_S}\nend_s = {end}\n"
        for end in ends
    )
    flight = fly(dark, seed=seed, changes=[WAVY, GOES, *table]).run(begin_s)
    for leg in range(legs):
        goal = dict(zip(("x_m", "y_m", "heading_rad"), POSES[leg], strict=True))
        flight.request("go_to", json.dumps(goal), request_id=leg + 1, author="tour")
        flight.run(LEG_S)
    errors = []
    for end in ends:
        state, truth = flight.of(VehicleState, stop_s=end)[-1], flight.of(ReferenceState, stop_s=end)[-1]
        age_s = (truth.stamp_ns - state.stamp_ns) * 1e-9
        reached = np.add(state.position_table_m, np.multiply(age_s, state.velocity_table_m_s))
        errors.append(math.dist(reached, truth.position_table_m))
    on_ms = sum(sum(demand.on_time_ms) for demand in flight.of(ValveDemand, start_s=begin_s))
    return np.array(errors), 1e-3 * on_ms, flight


@pytest.mark.slow
def test_with_the_true_map_an_outage_ends_nearer_to_the_truth(fly, tmp_path):
    path, seed = tmp_path / "map.toml", 3
    true_map(fly(seed=seed, changes=[WAVY]).rig, seed, path)
    without, _, _ = tour(fly, 1, seed)
    with_map, _, flight = tour(fly, 1, seed, path)
    assert with_map[0] < 0.4 * without[0]
    # what the filter still finds beyond a true map is little
    left = flight.of(FusionStatus)[-1].slope_left_m_s2
    assert math.hypot(*left) < 5e-4


def test_the_controller_pushes_against_the_slope_of_the_map_from_its_first_word(fly, tmp_path):
    path, seed = tmp_path / "map.toml", 5
    true_map(fly(seed=seed, changes=[WAVY]).rig, seed, path)
    table = ("y_max_m = 1.5", f'y_max_m = 1.5\nmap = "{path}"')
    here = (
        "hold = { x_m = 0.2, y_m = 0.1, heading_deg = 0.0 }",
        "hold = { x_m = 0.0, y_m = 0.0, heading_deg = 5.0 }",
    )
    flight = fly(seed=seed, changes=[WAVY, here, table]).run(3.0)
    (calibration,) = flight.of(FusionCalibration)
    assert calibration.names == ("table.map",)
    assert calibration.contents == (path.read_text(),)
    pull = TableMap.load(path).acceleration_m_s2(0.0, 0.0)
    first = flight.of(Wrench)[0]
    turn = math.radians(5.0)
    force = (
        math.cos(turn) * first.force_x_n - math.sin(turn) * first.force_y_n,
        math.sin(turn) * first.force_x_n + math.cos(turn) * first.force_y_n,
    )
    assert np.allclose(force, np.multiply(-flight.rig.mock_ups["standard"].mass_kg, pull), atol=4e-3)


@pytest.mark.slow
def test_surveyed_then_flown_with_its_map_a_table_costs_less_gas_and_outages_end_nearer(
    fly, tmp_path, monkeypatch, groundstation
):
    seed = 3
    monkeypatch.syspath_prepend(str(EXAMPLES))
    survey_laps, waypoints = (importlib.import_module(name) for name in ("survey_laps", "waypoints"))
    laps, made = tmp_path / "laps.mcap", tmp_path / "map.toml"
    waypoints.record(survey_laps.RIG, laps, 240.0, survey_laps.surveys(["alpha"]), seed)
    result = groundstation("calibrate", "table-map", laps, "--out", made)
    assert result.exit_code == 0, result.output
    without, gas_without, _ = tour(fly, 3, seed)
    with_map, gas_with, _ = tour(fly, 3, seed, made)
    assert np.sqrt((with_map**2).mean()) < 0.5 * np.sqrt((without**2).mean())
    assert gas_with < 0.97 * gas_without
