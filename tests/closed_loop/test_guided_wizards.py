"""Guided calibrations lead themselves on the emulator: hidden values come back within their sigmas.

What each is judged by is a flight that had no part in it.
"""

import importlib.util
import json
import tomllib
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from groundstation.declarations.request import Request
from groundstation.launch import guided

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1500)]
LONGEST_S = 700
QUICK = (("rate_hz = 1.5", "rate_hz = 5.0"), ("delay_s = 0.6", "delay_s = 0.1"))
AT_REST = (("bus_index = 0", "bus_index = 0\nstarts_by_itself = false"),)
EMULATED = Path(__file__).parents[2] / "calibration" / "rigs" / "emulated"
LENS_OF_LAB = 'source = "rendered"\ncamera = "../../calibration/rigs/emulated/camera.json"'
LIST_OF_RIG = 'ceiling = "../../calibration/rigs/emulated/ceiling.csv"\ndelay_s = 0.015\ndelay_sigma_s'
IDLE = ("[nodes.spot_finder]\nbusy_s = 0.6\n\n", "")


def hidden_valves():
    """The laboratory of `test_valves_learned`, whose valves the rig does not know."""
    spec = importlib.util.spec_from_file_location("_valves", Path(__file__).parent / "test_valves_learned.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def lead(fly):
    """Leads a wizard to its end: the outcome, the flight, the node."""

    def begin(name, rig, changes, more=""):
        arguments = {"rig": rig, "changes": changes, "short_rest": rig != "published_condition"}
        guide = guided.load_wizard(name).begin(fly(more, **arguments).rig, "alpha")
        node = guided.GuideNode("alpha", guide, lambda _: None, "test")
        flight = fly(more, **arguments, extra_nodes=[node])
        while not node.is_done and flight.runner.now_ns < LONGEST_S * 1e9:
            flight.run(0.5)
        assert node.is_done
        assert not node.trouble
        assert all(curve.x for picture in guide.pictures() for curve in picture.curves)
        return guide.outcome(), flight, guide

    return begin


def off(found, true):
    """By how many sigmas each quantity misses the truth."""
    return {name: (found[name].value - value) / found[name].sigma for name, value in true.items()}


def test_valves(lead):
    hidden = hidden_valves()
    changes = [("start_m = [0.0, 0.0]", f"start_m = [0.0, 0.0]\n{hidden.hidden()}"), *QUICK, *AT_REST]
    outcome, flight, guide = lead("valves", "drawn_fixes", changes)
    true = {}
    for valve, thrust_n in enumerate(hidden.THRUST_N):
        ratio = thrust_n / hidden.RIG_THRUST_N
        true[f"valve_{valve}_thrust_over_mass"] = ratio * hidden.RIG_MASS_KG / hidden.MASS_KG
        true[f"valve_{valve}_torque_over_inertia"] = ratio
        true[f"valve_{valve}_dead_time"] = hidden.OPEN_S - hidden.CLOSE_S
    missed = off(outcome.quantities, true)
    assert max(map(abs, missed.values())) < 3.5, missed
    judged = outcome.verification
    for name in ("velocity_x", "velocity_y", "rate"):
        assert judged[name].value < 0.5 * judged[f"{name}_as_the_rig_has_it"].value
    assert not outcome.warnings
    assert set(guide.outcomes.values()) == {"enough data"}
    assert [row.action for row in flight.of(Request) if row.action != "go_to"] == ["land", "fly"]


def test_motion_capture(lead, tmp_path):
    changes = [
        ("delay_s = 0.008\ndelay_sigma_s", "delay_s = 0.006\ndelay_sigma_s"),
        (
            'up = "y"\norigin_table_m = [0.4, -1.0, 0.05]\nyaw_deg = 35.0\nsigma',
            'up = "y"\norigin_table_m = [0.43, -1.02, 0.05]\nyaw_deg = 36.0\nsigma',
        ),
        (
            "pivot_body_m = [0.02, -0.03], pivot_yaw_deg = 15.0",
            "pivot_body_m = [0.0, 0.0], pivot_yaw_deg = 14.0",
        ),
        *AT_REST,
    ]
    outcome, _, _ = lead("motion_capture", "motion_capture", changes)
    true = {
        "origin_table_x": 0.4, "origin_table_y": -1.0, "yaw": 35.0, "pivot_body_x": 0.02,
        "pivot_body_y": -0.03, "pivot_yaw": 15.0, "delay": 0.008,
    }  # fmt: skip
    missed = off(outcome.quantities, true)
    assert max(map(abs, missed.values())) < 3.5, missed
    assert outcome.quantities["origin_table_x"].sigma < 1e-3
    assert outcome.verification["x"].value < 5e-4 < outcome.verification["x_as_the_rig_has_it"].value
    assert not outcome.warnings
    # the file holds what belongs into the rig, and what judged it
    path = tmp_path / "found.toml"
    text = outcome.written(path, "live", "0" * 64, datetime.now(UTC))[path]
    written = tomllib.loads(text)
    assert any(line.startswith("[motion_capture] origin_table_m = [0.4") for line in written["rig"])
    assert written["verification"]["x"]["value"] == pytest.approx(outcome.verification["x"].value)


def test_mount_turned_by_hand(lead, tmp_path):
    true = json.loads((EMULATED / "camera.json").read_text())
    x_m, y_m, z_m = true["mount_offset_body_m"]
    true["mount_offset_body_m"] = [x_m + 0.004, y_m - 0.006, z_m]
    true["mount_tilt_x_rad"] += 0.004
    (tmp_path / "true.json").write_text(json.dumps(true))
    changes = [
        (LENS_OF_LAB, f'source = "rendered"\ncamera = "{tmp_path / "true.json"}"'),
        IDLE,
        ("rate_hz = 15.0", "rate_hz = 3.0"),
        ("tilt_rad = [0.0003, -0.0001]", "tilt_rad = [0.0, 0.0]\nwaviness_rad = 0.0"),
        *AT_REST,
    ]
    hand = (
        '\n[[laboratory.failures]]\nkind = "pushed"\nvehicle = "alpha"\nstart_s = 8.0\nend_s = 9.0\n'
        "parameters = { force_x_n = 0.0, torque_nm = 0.06 }\n"
    )
    outcome, flight, _ = lead("mount", "published_condition", changes, hand)
    assert [row.action for row in flight.of(Request)] == ["float_on"]
    found = outcome.quantities
    missed = off(
        found,
        {
            "mount_offset_x_m": x_m + 0.004,
            "mount_offset_y_m": y_m - 0.006,
            "mount_tilt_x_rad": true["mount_tilt_x_rad"],
            "mount_tilt_y_rad": true["mount_tilt_y_rad"],
        },
    )
    assert max(map(abs, missed.values())) < 3.5, missed
    judged = outcome.verification
    assert judged["origin_wander"].value < 3e-4 < 5e-3 < judged["origin_wander_as_the_rig_has_it"].value
    assert judged["star_residual"].value < 0.05 < judged["star_residual_as_the_rig_has_it"].value
    assert not outcome.warnings


def test_lens(lead, tmp_path):
    true = json.loads((EMULATED / "camera.json").read_text())
    true["fx"] *= 1.004
    true["fy"] *= 1.003
    true["dist_k1_k2_p1_p2_k3"][0] += 0.004
    (tmp_path / "true.json").write_text(json.dumps(true))
    changes = [
        (LENS_OF_LAB, f'source = "rendered"\ncamera = "{tmp_path / "true.json"}"'),
        IDLE,
        ("rate_hz = 15.0", "rate_hz = 3.0"),
    ]
    outcome, _, _ = lead("lens", "published_condition", changes)
    names = ("fx", "fy", "cx", "cy")
    true |= dict(zip(("k1", "k2", "p1", "p2"), true["dist_k1_k2_p1_p2_k3"], strict=False))
    missed = off(outcome.quantities, {name: true[name] for name in (*names, "k1", "k2", "p1", "p2")})
    assert max(map(abs, missed.values())) < 3.5, missed
    judged = outcome.verification
    assert judged["star_residual"].value < 0.1 * judged["star_residual_as_the_rig_has_it"].value
    assert not outcome.warnings
    files = outcome.written(tmp_path / "lens.toml", "live", "0" * 64, datetime.now(UTC))
    assert json.loads(files[tmp_path / "lens.camera.json"])["fx"] == pytest.approx(true["fx"], rel=1e-4)


def read_list(text):
    """Places of a star list, as complex numbers."""
    rows = [line.split(",") for line in text.split()[1:]]
    return {row[0]: complex(float(row[1]), float(row[2])) for row in rows}


def test_survey(lead, tmp_path):
    true = read_list((EMULATED / "ceiling.csv").read_text())
    rng = np.random.default_rng(5)
    old = {name: place + complex(*rng.normal(0.0, 0.0015, 2)) for name, place in true.items()}
    lines = [f"{name},{place.real:.5f},{place.imag:.5f}" for name, place in old.items()]
    (tmp_path / "old.csv").write_text("\n".join(["id,x_m,y_m", *lines]) + "\n")
    changes = [
        (LIST_OF_RIG, f'ceiling = "{tmp_path / "old.csv"}"\ndelay_s = 0.015\ndelay_sigma_s'),
        IDLE,
        ("rate_hz = 15.0", "rate_hz = 2.0"),
    ]
    outcome, _, _ = lead("survey", "published_condition", changes)
    text = outcome.also[".csv"]
    found = read_list(text)
    place = np.array(list(found.values()))
    truth = np.array(list(true.values()))
    nearest = truth[np.abs(place[:, None] - truth[None]).argmin(axis=1)]
    assert len(found) > 0.8 * len(true)
    # the frame is held by stars of the old list, whose errors are 1.5 mm each
    assert np.abs(place - nearest).max() < 1.5e-3
    assert np.sqrt((np.abs(place - nearest) ** 2).mean()) < 0.5 * 0.0015 * np.sqrt(2.0)
    # the shape is held by the pictures: within its sigmas, but for shift, turn and scale
    columns = np.column_stack((place, np.ones(len(place))))
    left = columns @ np.linalg.lstsq(columns, nearest, rcond=None)[0] - nearest
    sigma = np.array([[float(value) for value in line.split(",")[3:5]] for line in text.split()[1:]])
    scattered = np.column_stack((left.real, left.imag)) / sigma
    assert 0.7 < np.sqrt((scattered**2).mean()) < 1.5
    judged = outcome.verification
    assert judged["star_residual"].value < 0.2 * judged["star_residual_as_the_rig_has_it"].value
