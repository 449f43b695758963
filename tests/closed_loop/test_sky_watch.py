"""LEDs of the emulated ceiling die, move and appear in flight: the station names them and flies on."""

import csv
import math
from pathlib import Path

import pytest

from groundstation.declarations.errors import UsageError
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.stars.messages import SkyChange, StarFix
from groundstation.rig.read import parse_rig
from groundstation.star_tracking.star_catalogue import StarCatalogue

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "late_pipeline.toml"
CEILING = RIG.parents[2] / "calibration" / "rigs" / "emulated" / "ceiling.csv"
FAULT = """
[[laboratory.faults]]
kind = "{kind}"
vehicle = "alpha"
start_s = {start_s}
end_s = {end_s}
parameters = {{ {parameters} }}
"""
NEW_M = (0.33, 0.21)
SHIFT_M = (0.011, -0.006)


def stars_over_the_start():
    """Rows of the star list by their distance from where the mock-up stands: all are in the picture."""
    with CEILING.open(newline="") as file:
        rows = [
            (i, row["id"], float(row["x_m"]), float(row["y_m"])) for i, row in enumerate(csv.DictReader(file))
        ]
    return sorted(rows, key=lambda row: math.hypot(*row[2:]))


def fault(kind, start_s, end_s="inf", **parameters):
    words = ", ".join(f"{name} = {value}" for name, value in parameters.items())
    return FAULT.format(kind=kind, start_s=start_s, end_s=end_s, parameters=words)


@pytest.mark.slow
def test_stars_that_die_move_and_appear_are_named_while_flying_and_come_back(fly):
    dead, moved = stars_over_the_start()[2:4]
    flight = fly(
        fault("dead_star", 3.0, 6.0, star=dead[0])
        + fault("moved_star", 3.0, 6.0, star=moved[0], dx_m=SHIFT_M[0], dy_m=SHIFT_M[1])
        + fault("new_star", 3.0, 7.0, x_m=NEW_M[0], y_m=NEW_M[1]),
        rig="late_pipeline",
    ).run(10.0)
    changes = flight.of(SkyChange)
    assert all(change.stamp_ns > 3_000_000_000 for change in changes)
    first = {}
    for change in changes:
        first.setdefault((change.change, change.star), change)
    assert set(first) == {
        ("died", dead[1]),
        ("revived", dead[1]),
        ("moved", moved[1]),
        ("returned", moved[1]),
        ("appeared", ""),
        ("vanished", ""),
    }
    place = first["moved", moved[1]]
    assert math.hypot(place.x_m - moved[2] - SHIFT_M[0], place.y_m - moved[3] - SHIFT_M[1]) < 3e-4
    new = first["appeared", ""]
    assert math.hypot(new.x_m - NEW_M[0], new.y_m - NEW_M[1]) < 3e-4
    assert new.sightings == 25
    assert 0.0 < new.place_covariance[0] < 1e-7
    assert all(fix.fix for fix in flight.of(StarFix))
    mode_of = {fix.mode for fix in flight.of(StarFix, start_s=5.0)}
    assert mode_of == {"tracking", "lost-in-space"}


@pytest.mark.slow
def test_what_the_watchdog_found_is_applied_to_the_star_list(tmp_path, groundstation):
    dead, moved = stars_over_the_start()[2:4]
    text = RIG.read_text().replace("../../calibration", str(RIG.parents[2] / "calibration"))
    text = text.replace("late_s = 0.6", "late_s = 0.0") + "[mock_ups.standard.fusion]\nrest_s = 1.0\n"
    text += fault("dead_star", 0.0, star=dead[0]) + fault("new_star", 0.0, x_m=NEW_M[0], y_m=NEW_M[1])
    text += fault("moved_star", 0.0, star=moved[0], dx_m=SHIFT_M[0], dy_m=SHIFT_M[1])
    rig_path, recording, out = tmp_path / "rig.toml", tmp_path / "run.mcap", tmp_path / "amended.csv"
    rig_path.write_text(text)
    run_lockstep(parse_rig(text, rig_path), text, rig_path, recording, 4.5, 3, lambda *_: None)
    call = ["calibrate", "amend", CEILING, recording, "--out", out]
    result = groundstation(*call)
    assert f"star {dead[1]}: struck off" in result.stdout
    before, after = StarCatalogue.load(CEILING), StarCatalogue.load(out)
    assert len(after.ids) == len(before.ids)  # one less, one more
    assert dead[1] not in after.ids
    row = after.ids.index(moved[1])
    assert math.hypot(after.x_m[row] - moved[2] - SHIFT_M[0], after.y_m[row] - moved[3] - SHIFT_M[1]) < 3e-4
    assert math.hypot(after.x_m[-1] - NEW_M[0], after.y_m[-1] - NEW_M[1]) < 3e-4
    assert 0.0 < after.sigma_m[-1] < 3e-4
    assert after.ids[-1] not in before.ids
    written = out.with_suffix(".toml").read_text()
    assert f'struck = ["{dead[1]}"]' in written
    assert "recording_sha256" in written
    other = tmp_path / "other.csv"
    other.write_text("\n".join(CEILING.read_text().splitlines()[:-1]) + "\n")
    with pytest.raises(UsageError, match="another star list"):
        groundstation("calibrate", "amend", other, *call[3:])
