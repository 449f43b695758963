"""Make a data set for `groundstation fusion run`, with the truth beside it.

    python tools/fusion_truth.py OUT_FOLDER --scenario perimeter --seed 3

A small laboratory of its own, written apart from the emulator and from the filter: a rigid body on an air
table with eight valves under a 5 Hz pulse-width controller, 1 kHz polls averaged into packets, star fixes
0.6 s late. It shares no line with what it judges. Figures that no data sheet gives (knocks of opening
valves, waviness of the table, share of wild packets) are settings of `Laboratory`, drawn anew for each seed.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fusion_laboratory import POLL_S, SCENARIOS, Array, Laboratory, Table
from fusion_motion import fly
from fusion_sensors import LEVER_M, LEVER_SIGMA_M, TEMPCO, read_imu, see_stars

__all__ = ["DataSet", "Laboratory", "Table", "make", "write"]


@dataclass
class DataSet:
    """Arrays as in the files: rows of packets, fixes and truth, and the meta block."""

    imu: Array
    stars: Array
    truth: Array
    meta: dict[str, object]


TRUTH_COLUMNS = (
    "t_s,x_m,y_m,heading_rad,vx_m_s,vy_m_s,omega_rad_s,ax_m_s2,ay_m_s2,thrusters,"
    "bias_omega,bias_ax,bias_ay,slope_ax,slope_ay"
)


def make(lab: Laboratory) -> DataSet:
    """Make one data set; the same settings give the same numbers."""
    rng = np.random.default_rng([lab.seed, SCENARIOS.index(lab.scenario)])
    if lab.scenario == "outage" and lab.outage_s is None:
        lab.outage_s = (55.0, 65.0)
    table_rng = rng if lab.table_seed is None else np.random.default_rng([lab.table_seed, 99])
    table = Table(table_rng, lab.waviness_m_s2)
    if lab.scenario == "rest":
        lab.run_start_s = lab.duration_s
    truth = fly(lab, rng, table)
    imu, bias = read_imu(lab, rng, truth)
    stars, wrong = see_stars(lab, rng, truth)
    return DataSet(imu, stars, _truth_rows(truth, bias), _meta(lab, wrong))


def _truth_rows(truth: dict[str, Array], bias: Array) -> Array:
    n = len(bias)
    rows = np.arange(0, n + 1, 10)
    near = np.minimum(rows, n - 1)
    return np.column_stack(
        [
            rows * POLL_S, truth["p"][rows], truth["theta"][rows], truth["v"][rows], truth["omega"][rows],
            truth["acc"][near], truth["mask"][near], bias[near], truth["slope"][near],
        ]
    )  # fmt: skip


def _meta(lab: Laboratory, wrong: list[list[object]]) -> dict[str, object]:
    known = {
        "run_start_s": lab.run_start_s, "duration_s": lab.duration_s, "imu_rate_hz": 1e3 / lab.packet_polls,
        "poll_rate_hz": 1000.0, "imu_offset_m": LEVER_M.tolist(), "imu_offset_sigma_m": LEVER_SIGMA_M,
        "mass_kg": 11.0, "inertia_kg_m2": 0.25, "star_sigma_xy_m": lab.star_sigma_xy,
        "star_sigma_heading_rad": lab.star_sigma_heading, "star_delay_s": lab.star_busy_s,
        "gyro_noise_poll_rad_s": lab.gyro_noise, "gyro_lsb_rad_s": lab.gyro_lsb,
        "acc_noise_poll_m_s2": lab.acc_noise, "acc_lsb_m_s2": lab.acc_lsb,
        "gyro_tempco_rad_s_C": TEMPCO[0], "acc_tempco_m_s2_C": TEMPCO[1],
        "gyro_bandwidth_hz": lab.gyro_bandwidth_hz, "acc_bandwidth_hz": lab.acc_bandwidth_hz,
    }  # fmt: skip
    mode = {
        "rest": "rest",
        "station": "hold",
        "warmup": "hold",
        "drift": "drift",
        "spin": "spin",
    }
    return {
        "format": "airtable-fusion-1", "scenario": lab.scenario, "seed": lab.seed, "known": known,
        "truth": {
            "config": {"mode": mode.get(lab.scenario, "track"), "outage": list(lab.outage_s or ())},
            "wrong_fixes": wrong,
        },
    }  # fmt: skip


def write(data: DataSet, folder: Path) -> None:
    """Write imu.csv, stars.csv, truth.csv and meta.json."""
    folder.mkdir(parents=True, exist_ok=True)
    np.savetxt(folder / "imu.csv", data.imu, "%.6f,%.8f,%.7f,%.7f,%.3f", comments="",
               header="t_s,omega_rad_s,ax_m_s2,ay_m_s2,temperature_C")  # fmt: skip
    np.savetxt(folder / "stars.csv", data.stars, "%.6f,%.6f,%.6f,%.6f,%.7f", comments="",
               header="t_exposure_s,t_arrival_s,x_m,y_m,heading_rad")  # fmt: skip
    np.savetxt(
        folder / "truth.csv",
        data.truth,
        "%.9g",
        delimiter=",",
        comments="",
        header=TRUTH_COLUMNS,
    )
    (folder / "meta.json").write_text(json.dumps(data.meta, indent=1))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Make a fusion data set with truth.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenario", choices=SCENARIOS, default="station")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--wrong", type=float, default=0.02, help="share of wrong fixes")
    arguments = parser.parse_args()
    lab = Laboratory(scenario=arguments.scenario, seed=arguments.seed, wrong_share=arguments.wrong)
    if lab.scenario in ("perimeter", "outage"):
        lab.duration_s = 130.0 if lab.scenario == "perimeter" else 100.0
    elif lab.scenario in ("rest", "spin"):
        lab.duration_s = 60.0 if lab.scenario == "rest" else 70.0
    write(make(lab), arguments.folder)


if __name__ == "__main__":
    main()
