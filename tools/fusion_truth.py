"""Make a data set for `groundstation fusion run`, with the truth beside it.

    python tools/fusion_truth.py OUT_FOLDER --scenario perimeter --seed 3

A small laboratory of its own, written apart from the emulator and from the filter: a rigid body on an air
table with eight valves under a 5 Hz pulse-width controller, 1 kHz polls averaged into packets, star fixes
0.6 s late. It shares no line with what it judges. Figures that no data sheet gives (knocks of switching
valves, waviness of the table, share of wild packets) are settings of `Laboratory`, drawn anew for each seed.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
G = 9.80665
SCENARIOS = ("rest", "station", "drift", "perimeter", "spin", "outage", "warmup")
POLL_S = 1e-3
CONTROL_POLLS = 200


@dataclass
class Laboratory:
    """Settings of one data set; the defaults are the published condition."""

    scenario: str = "station"
    seed: int = 1
    run_start_s: float = 10.0
    duration_s: float = 100.0
    packet_polls: int = 10
    gyro_noise: float = math.radians(0.1)
    gyro_lsb: float = 0.2439 * math.pi / 180.0
    acc_noise: float = 2e-3
    acc_lsb: float = 1.25e-3
    gyro_bandwidth_hz: float = 0.0
    acc_bandwidth_hz: float = 0.0
    star_sigma_xy: float = 1e-3
    star_sigma_heading: float = math.radians(0.05)
    star_busy_s: float = 0.6
    stamp_jitter_s: float = 9e-4
    """Of the exposures' stamps."""
    wrong_share: float = 0.02
    wild_rate_hz: float = 0.04
    hole_rate_hz: float = 0.2
    knock_m_s2: float = 0.02
    """Of one poll in the three milliseconds after a valve switches."""
    gyro_warm_up_rad_s: float = 0.0
    """How far the gyro's null creeps after switching on, over some minutes."""
    outage_s: tuple[float, float] | None = None
    table_seed: int | None = None
    """The same table under other noise, for maps."""
    faults: bool = True
    acc_matrix_sigma: float = 0.008
    """Of the accelerometers' scale and of the angles between their axes and the body's."""
    waviness_m_s2: tuple[float, float] = (1.3e-4, 2.8e-4)
    """Range of the RMS of the table's waves, per axis."""


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


class Table:
    """Gravity along the table: a mean tilt and a few waves."""

    def __init__(self, rng: np.random.Generator, waviness_m_s2: tuple[float, float]) -> None:
        self.tilt = rng.normal(0.0, 0.3e-3 * G, 2)
        n = 12
        length = rng.uniform(0.4, 1.1, n)
        angle = rng.uniform(0.0, 2.0 * math.pi, n)
        self.k = 2.0 * math.pi / length[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        self.phase = rng.uniform(0.0, 2.0 * math.pi, n)
        height = rng.normal(0.0, 1.0, n) * length**1.5
        raw = height[:, None] * self.k * G / math.sqrt(2.0)
        rms = rng.uniform(*waviness_m_s2) * math.sqrt(2.0)
        self.height = height * rms / math.sqrt(float((raw**2).sum()))

    def slope(self, p: Array) -> Array:
        """Return the pull (n, 2) in m/s^2 at positions (n, 2)."""
        wave = np.cos(p @ self.k.T + self.phase) * self.height
        return np.asarray(self.tilt - G * (wave @ self.k))


def _valves(rng: np.random.Generator) -> tuple[Array, Array]:
    """Return (8, 3) force x, y and torque per valve, and (8,) their thrusts' ratios."""
    arm = 0.15
    layout = [(1, 0, 0, arm), (1, 0, 0, -arm), (-1, 0, 0, arm), (-1, 0, 0, -arm)]
    layout += [(0, 1, arm, 0), (0, 1, -arm, 0), (0, -1, arm, 0), (0, -1, -arm, 0)]
    rows = [(fx, fy, x * fy - y * fx) for fx, fy, x, y in layout]
    return 0.22 * np.array(rows, float), rng.normal(1.0, 0.03, 8)


def _goal(lab: Laboratory, t: float, start: Array) -> tuple[Array, Array]:
    """Return pose (x, y, heading) and its rate wanted at `t` after the start of the run."""
    if lab.scenario == "drift":
        return start, np.zeros(3)
    if lab.scenario in ("station", "warmup"):
        step = np.array([0.05, -0.24, 0.3]) if t < 400.0 else np.array([0.2, 0.1, -0.4])
        share = min(1.0, t / 15.0)
        return start + step * share, step * (t < 15.0) / 15.0
    if lab.scenario == "spin":
        period, top = 24.0, 0.78
        return start, np.array([0.0, 0.0, top if (t % period) < 12.0 else -top])
    # a lap around a rectangle at 0.07 m/s, the heading turning with the corners
    corners = np.array([[0.0, 0.0], [1.5, 0.0], [1.5, 1.08], [0.0, 1.08]])
    lengths = np.array([1.5, 1.08, 1.5, 1.08])
    speed, turn_s = 0.07, 4.3
    along = t * speed
    leg = 0
    while along > lengths[leg % 4]:
        along -= lengths[leg % 4]
        leg += 1
    a, b = corners[leg % 4], corners[(leg + 1) % 4]
    way = (b - a) / lengths[leg % 4]
    since = along / speed
    turning = leg > 0 and since < turn_s
    heading = (leg - 1 + since / turn_s if turning else leg) * math.pi / 2.0
    pose = np.array([*(start[:2] + a + way * along), start[2] + heading])
    return pose, np.array([*(way * speed), math.pi / 2.0 / turn_s if turning else 0.0])


def _fly(lab: Laboratory, rng: np.random.Generator, table: Table) -> dict[str, Array]:
    """Integrate the truth at 1 kHz; arrays at the polls, accelerations as means over each poll."""
    n = round(lab.duration_s / POLL_S)
    out = {k: np.zeros((n + 1, 2)) for k in ("p", "v")} | {k: np.zeros(n + 1) for k in ("theta", "omega")}
    acc, alpha, slope = np.zeros((n, 2)), np.zeros(n), np.zeros((n, 2))
    mask, knocks = np.zeros(n, int), np.zeros(n, bool)
    pull, ratio = _valves(rng)
    mass, inertia, min_on = 11.0, 0.25, 0.010
    perimeter = lab.scenario in ("perimeter", "outage")
    start = np.array([*((-0.72, -0.5) if perimeter else rng.uniform(-0.25, 0.25, 2)), rng.normal(0.0, 0.02)])
    p, v, theta, omega = start[:2].copy(), np.zeros(2), float(start[2]), 0.0
    level = np.zeros(8)
    first = round(lab.run_start_s / POLL_S)
    if lab.scenario == "drift":
        v_start, w_start = rng.uniform(-0.008, 0.008, 2), rng.uniform(-0.03, 0.03)  # a push of 0.2 s
    wanted_v = np.zeros(2)
    decay = math.exp(-POLL_S / 0.004)
    i = 0
    while i < n:
        m = min(CONTROL_POLLS, n - i)
        if i < first < i + m:
            m = first - i
        out["p"][i], out["v"][i], out["theta"][i], out["omega"][i] = p, v, theta, omega
        if i < first or lab.scenario == "rest":
            out["p"][i : i + m], out["theta"][i : i + m] = p, theta
            slope[i : i + m] = table.slope(p[None])
            i += m
            continue
        t = (i - first) * POLL_S
        on = np.zeros(8)
        gliding = lab.scenario == "drift" and float(np.hypot(*(p - start[:2]))) < 0.3
        if not gliding and m == CONTROL_POLLS:
            pose, rate = _goal(lab, t, start)
            seen_p = p + rng.normal(0.0, 1.5e-3, 2)
            seen_v = v + rng.normal(0.0, 1.0e-3, 2)
            wanted_v += np.clip(rate[:2] - wanted_v, -0.004, 0.004)
            a = np.clip(0.05 * (pose[:2] - seen_p) + 0.5 * (wanted_v - seen_v), -0.03, 0.03)
            c, s = math.cos(theta), math.sin(theta)
            body = mass * np.array([c * a[0] + s * a[1], -s * a[0] + c * a[1]])
            wrong = pose[2] - theta if lab.scenario != "spin" else 0.0
            torque = inertia * float(np.clip(0.5 * wrong + 1.5 * (rate[2] - omega), -0.2, 0.2))
            for axis, (k0, k1) in enumerate(((0, 2), (4, 6))):
                share = torque / 0.15 * (-0.25 if axis == 0 else 0.25)
                side = k0 if body[axis] > 0 else k1
                sign = 1.0 if body[axis] > 0 else -1.0
                on[side] += max(0.0, abs(body[axis]) / 2 + sign * share) / 0.22
                on[side + 1] += max(0.0, abs(body[axis]) / 2 - sign * share) / 0.22
            on = np.clip(on, 0.0, 0.9) * CONTROL_POLLS * POLL_S
            on[on < min_on] = 0.0
        tau = np.arange(m) * POLL_S
        open_ = (tau[:, None] >= 0.006) & (tau[:, None] < 0.006 + on)
        force = np.empty((m, 8))
        for j in range(m):
            level = open_[j] + (level - open_[j]) * decay
            force[j] = level
        switched = np.zeros(m, bool)
        switched[1:] = (open_[1:] != open_[:-1]).any(axis=1)
        for j in range(3):
            knocks[i + j : i + m] |= switched[: m - j]
        sag = 1.0 - 0.03 * np.maximum(0, open_.sum(axis=1) - 1)
        wrench = (force * ratio * sag[:, None]) @ pull
        if lab.scenario == "drift" and i == first:
            c, s = math.cos(theta), math.sin(theta)
            push = mass * v_start / (m * POLL_S)
            wrench += [c * push[0] + s * push[1], c * push[1] - s * push[0], inertia * w_start / (m * POLL_S)]
        alpha[i : i + m] = wrench[:, 2] / inertia
        omegas = omega + np.concatenate([[0.0], np.cumsum(alpha[i : i + m])]) * POLL_S
        thetas = theta + np.concatenate([[0.0], np.cumsum(0.5 * (omegas[1:] + omegas[:-1]))]) * POLL_S
        middle = 0.5 * (thetas[1:] + thetas[:-1])
        c, s = np.cos(middle), np.sin(middle)
        here = table.slope(p + v * tau[:, None])
        slope[i : i + m] = here
        acc[i : i + m, 0] = (c * wrench[:, 0] - s * wrench[:, 1]) / mass + here[:, 0] - 2e-3 * v[0]
        acc[i : i + m, 1] = (s * wrench[:, 0] + c * wrench[:, 1]) / mass + here[:, 1] - 2e-3 * v[1]
        vs = np.vstack([v, v + np.cumsum(acc[i : i + m], axis=0) * POLL_S])
        ps = np.vstack([p, p + np.cumsum(0.5 * (vs[1:] + vs[:-1]), axis=0) * POLL_S])
        out["p"][i : i + m], out["v"][i : i + m] = ps[:-1], vs[:-1]
        out["theta"][i : i + m], out["omega"][i : i + m] = thetas[:-1], omegas[:-1]
        mask[i : i + m] = (open_ * (1 << np.arange(8))).sum(axis=1)
        p, v, theta, omega = ps[-1], vs[-1], float(thetas[-1]), float(omegas[-1])
        i += m
    out["p"][n], out["v"][n], out["theta"][n], out["omega"][n] = p, v, theta, omega
    return out | {"acc": acc, "alpha": alpha, "slope": slope, "mask": mask, "knocks": knocks}


def _low_pass(u: Array, bandwidth_hz: float) -> Array:
    if bandwidth_hz <= 0.0:
        return u
    keep = math.exp(-POLL_S * 2.0 * math.pi * bandwidth_hz)
    out = np.empty_like(u)
    y = u[0]
    for i, value in enumerate(u):
        y = value + (y - value) * keep
        out[i] = y
    return out


def make(lab: Laboratory) -> DataSet:
    """Make one data set; the same settings give the same numbers."""
    rng = np.random.default_rng([lab.seed, SCENARIOS.index(lab.scenario)])
    if lab.scenario == "outage" and lab.outage_s is None:
        lab.outage_s = (60.0, 70.0)
    table_rng = rng if lab.table_seed is None else np.random.default_rng([lab.table_seed, 99])
    table = Table(table_rng, lab.waviness_m_s2)
    if lab.scenario == "rest":
        lab.run_start_s = lab.duration_s
    truth = _fly(lab, rng, table)
    n = len(truth["alpha"])
    t = np.arange(1, n + 1) * POLL_S
    warm = (0.5 if lab.scenario != "warmup" else 6.0) * (1.0 - np.exp(-t / 60.0))
    lever_known = np.array([0.0315, -0.0212])
    lever = lever_known + rng.normal(0.0, 1e-3, 2)
    mid_theta = 0.5 * (truth["theta"][1:] + truth["theta"][:-1])
    mid_omega = 0.5 * (truth["omega"][1:] + truth["omega"][:-1])
    c, s = np.cos(mid_theta), np.sin(mid_theta)
    felt = truth["acc"] - truth["slope"]
    if lab.scenario == "rest" or lab.run_start_s > 0.0:
        felt[: round(lab.run_start_s / POLL_S)] = -truth["slope"][: round(lab.run_start_s / POLL_S)]
    fx = c * felt[:, 0] + s * felt[:, 1] - truth["alpha"] * lever[1] - mid_omega**2 * lever[0]
    fy = -s * felt[:, 0] + c * felt[:, 1] + truth["alpha"] * lever[0] - mid_omega**2 * lever[1]
    skew = rng.normal(0.0, lab.acc_matrix_sigma, (2, 2))
    scale = 1.0 + rng.normal(0.0, 1.5e-3)
    bias = np.empty((n, 3))
    walk = np.array([1.2e-5, 1.55e-5, 1.55e-5]) * math.sqrt(POLL_S)
    tempco = np.array([3.5e-4, 3e-4, 3e-4]) * rng.normal(1.0, 0.4, 3)
    switch_on = rng.normal(0.0, 1.0, 3) * np.array([math.radians(0.3), 0.05, 0.05])
    bias[:] = switch_on + warm[:, None] * tempco + np.cumsum(rng.normal(0.0, 1.0, (n, 3)) * walk, axis=0)
    bias[:, 0] += lab.gyro_warm_up_rad_s * (1.0 - np.exp(-t / 120.0))
    knock = rng.normal(0.0, lab.knock_m_s2, (n, 2)) * truth["knocks"][:, None]
    omega_read = scale * mid_omega + bias[:, 0]
    ax_read = (1 + skew[0, 0]) * fx + skew[0, 1] * fy + bias[:, 1] + knock[:, 0]
    ay_read = skew[1, 0] * fx + (1 + skew[1, 1]) * fy + bias[:, 2] + knock[:, 1]
    polls = np.column_stack(
        [
            np.round(
                (_low_pass(omega_read, lab.gyro_bandwidth_hz) + rng.normal(0, lab.gyro_noise, n))
                / lab.gyro_lsb
            )
            * lab.gyro_lsb,
            np.round(
                (_low_pass(ax_read, lab.acc_bandwidth_hz) + rng.normal(0, lab.acc_noise, n)) / lab.acc_lsb
            )
            * lab.acc_lsb,
            np.round(
                (_low_pass(ay_read, lab.acc_bandwidth_hz) + rng.normal(0, lab.acc_noise, n)) / lab.acc_lsb
            )
            * lab.acc_lsb,
        ]
    )
    polls_each = lab.packet_polls
    packets = polls[: n // polls_each * polls_each].reshape(-1, polls_each, 3).mean(axis=1)
    ends = np.arange(1, len(packets) + 1) * polls_each * POLL_S
    stamps = ends + rng.normal(0.0, 3e-4 * min(1.0, polls_each / 10), len(ends))
    warmth = 24.0 + np.round(warm[polls_each - 1 :: polls_each][: len(ends)] / 0.1453) * 0.1453
    imu = np.column_stack([stamps, packets, warmth])
    if lab.faults:
        imu = _break_packets(lab, rng, imu, polls_each * POLL_S)
    imu = imu[np.argsort(imu[:, 0], kind="stable")]
    stars, wrong = _stars(lab, rng, truth, t)
    rows = np.arange(0, n + 1, 10)
    near = np.minimum(rows, n - 1)
    table_rows = np.column_stack(
        [
            rows * POLL_S, truth["p"][rows], truth["theta"][rows], truth["v"][rows], truth["omega"][rows],
            truth["acc"][near], truth["mask"][near], bias[near], truth["slope"][near],
        ]
    )  # fmt: skip
    known = {
        "run_start_s": lab.run_start_s, "duration_s": lab.duration_s, "imu_rate_hz": 1000.0 / polls_each,
        "poll_rate_hz": 1000.0, "imu_offset_m": lever_known.tolist(), "imu_offset_sigma_m": 1e-3,
        "mass_kg": 11.0, "inertia_kg_m2": 0.25, "star_sigma_xy_m": lab.star_sigma_xy,
        "star_sigma_heading_rad": lab.star_sigma_heading, "star_delay_s": lab.star_busy_s,
        "gyro_noise_poll_rad_s": lab.gyro_noise, "gyro_lsb_rad_s": lab.gyro_lsb,
        "acc_noise_poll_m_s2": lab.acc_noise, "acc_lsb_m_s2": lab.acc_lsb,
        "gyro_tempco_rad_s_C": 3.5e-4, "acc_tempco_m_s2_C": 3e-4,
        "gyro_bandwidth_hz": lab.gyro_bandwidth_hz, "acc_bandwidth_hz": lab.acc_bandwidth_hz,
    }  # fmt: skip
    mode = {"rest": "rest", "station": "hold", "warmup": "hold", "drift": "drift", "spin": "spin"}
    meta: dict[str, object] = {
        "format": "airtable-fusion-1", "scenario": lab.scenario, "seed": lab.seed, "known": known,
        "truth": {
            "config": {"mode": mode.get(lab.scenario, "track"), "outage": list(lab.outage_s or ())},
            "wrong_fixes": wrong,
        },
    }  # fmt: skip
    return DataSet(imu, stars, table_rows, meta)


def _break_packets(lab: Laboratory, rng: np.random.Generator, imu: Array, period_s: float) -> Array:
    n = len(imu)
    for i in np.nonzero(rng.random(n) < lab.wild_rate_hz * period_s)[0]:
        what = rng.integers(3)
        if what == 0:
            imu[i, 1] += rng.normal(0.0, 0.7)
        else:
            imu[i, 2:4] += rng.normal(0.0, 0.5, 2) * rng.integers(1, 3)
    keep = np.ones(n, bool)
    for i in np.nonzero(rng.random(n) < lab.hole_rate_hz * period_s)[0]:
        keep[i] = False
        if rng.random() < 0.15:
            keep[i : i + round(rng.uniform(0.02, 0.12) / period_s)] = False
    return imu[keep]


def _stars(
    lab: Laboratory, rng: np.random.Generator, truth: dict[str, Array], t: Array
) -> tuple[Array, list[list[object]]]:
    """Return rows of fixes in order of arrival, and which of them are wrong."""
    rows: list[list[float]] = []
    wrong: list[tuple[int, str]] = []
    grid = np.concatenate([[0.0], t])
    exposure = 0.3
    while exposure + lab.star_busy_s < lab.duration_s:
        late = lab.star_busy_s + rng.exponential(0.012)
        seen = exposure + rng.normal(0.0, 2e-4)
        blind = lab.outage_s is not None and lab.outage_s[0] <= exposure < lab.outage_s[1]
        if not blind and not (lab.faults and rng.random() < 0.06):
            pose = np.array(
                [np.interp(seen, grid, truth["p"][:, 0]), np.interp(seen, grid, truth["p"][:, 1]),
                 np.interp(seen, grid, truth["theta"])]
            )  # fmt: skip
            pose += rng.normal(0.0, 1.0, 3) * [lab.star_sigma_xy, lab.star_sigma_xy, lab.star_sigma_heading]
            if lab.faults and rng.random() < lab.wrong_share:
                if rng.random() < 0.75:
                    wrong.append((len(rows), "gross"))
                    pose += rng.uniform(-1, 1, 3) * [0.8, 0.8, math.pi]
                else:
                    wrong.append((len(rows), "subtle"))
                    angle = rng.uniform(0, 2 * math.pi)
                    pose += [0.03 * math.cos(angle), 0.03 * math.sin(angle), rng.normal(0, 0.006)]
            pose[2] = math.remainder(pose[2], 2 * math.pi)
            rows.append([round(seen + rng.normal(0.0, lab.stamp_jitter_s), 6), seen + late, *pose])
        exposure = math.ceil((exposure + late) * 15.0) / 15.0
    return np.array(rows), [[rows[index][0], kind] for index, kind in wrong]


def write(data: DataSet, folder: Path) -> None:
    """Write imu.csv, stars.csv, truth.csv and meta.json."""
    folder.mkdir(parents=True, exist_ok=True)
    np.savetxt(folder / "imu.csv", data.imu, "%.6f,%.8f,%.7f,%.7f,%.3f", comments="",
               header="t_s,omega_rad_s,ax_m_s2,ay_m_s2,temperature_C")  # fmt: skip
    np.savetxt(folder / "stars.csv", data.stars, "%.6f,%.6f,%.6f,%.6f,%.7f", comments="",
               header="t_exposure_s,t_arrival_s,x_m,y_m,heading_rad")  # fmt: skip
    np.savetxt(folder / "truth.csv", data.truth, "%.9g", delimiter=",", comments="", header=TRUTH_COLUMNS)
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
