"""The station's star list differs from the ceiling that hangs there: the watchdog of the sky must say so."""

import math
from pathlib import Path

import pytest

from groundstation.messages import definitions as m
from groundstation.runtime.lockstep_run import make_runner
from groundstation.runtime.rig import parse_rig

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "late_pipeline.toml"
CEILING = RIG.parents[2] / "calibration" / "rigs" / "emulated" / "ceiling.csv"


@pytest.mark.slow
def test_a_star_too_many_is_dead_and_a_star_too_few_has_appeared(tmp_path):
    header, *rows = CEILING.read_text().splitlines()
    near = sorted(rows, key=lambda row: math.hypot(*map(float, row.split(",")[1:])))
    missing = near[3]
    _, x_m, y_m = missing.split(",")
    listed = [row for row in rows if row != missing]
    ceiling = tmp_path / "ceiling.csv"
    ceiling.write_text("\n".join([header, *listed, "900,0.33,0.21"]) + "\n")
    station, laboratory = RIG.read_text().split("[laboratory]", 1)
    station = station.replace("../../calibration/rigs/emulated/ceiling.csv", str(ceiling))
    found = []

    def observe(delivered, now_ns):
        if isinstance(delivered.payload, m.SkyChange):
            found.append(delivered.payload)

    runner = make_runner(parse_rig(station + "[laboratory]" + laboratory, RIG.resolve()), 1, [observe])
    runner.run(7_000_000_000)
    runner.close()
    assert {(change.change, change.star) for change in found} == {("died", "900"), ("appeared", "")}
    new = next(change for change in found if change.change == "appeared")
    assert math.hypot(new.x_m - float(x_m), new.y_m - float(y_m)) < 1e-3
