"""What a generated fusion data set's sensors say of the truth: packets of polls, late star fixes."""

from __future__ import annotations

import math

import numpy as np
from fusion_laboratory import POLL_S, Array, Laboratory

KNOCK_POLLS = 3
LEVER_M = np.array([0.0315, -0.0212])
"""Of the accelerometers, as known."""
LEVER_SIGMA_M = 1e-3
TEMPCO = np.array([3.5e-4, 3e-4, 3e-4])
"""As known; the true ones are off by 40 %."""


def read_imu(lab: Laboratory, rng: np.random.Generator, truth: dict[str, Array]) -> tuple[Array, Array]:
    """Return rows of imu.csv, and the true biases (n, 3) at the polls."""
    n = len(truth["alpha"])
    t = np.arange(1, n + 1) * POLL_S
    warm = (0.5 if lab.scenario != "warmup" else 6.0) * (1.0 - np.exp(-t / 60.0))
    lever = LEVER_M + rng.normal(0.0, LEVER_SIGMA_M, 2)
    omega = 0.5 * (truth["omega"][1:] + truth["omega"][:-1])
    felt = _felt(lab, truth)
    felt[0] -= truth["alpha"] * lever[1] + omega**2 * lever[0]
    felt[1] += truth["alpha"] * lever[0] - omega**2 * lever[1]
    matrix = np.eye(2) + rng.normal(0.0, lab.acc_matrix_sigma, (2, 2))
    scale = 1.0 + rng.normal(0.0, 1.5e-3)
    walk = np.array([1.2e-5, 1.55e-5, 1.55e-5]) * math.sqrt(POLL_S)
    switch_on = rng.normal(0.0, 1.0, 3) * np.array([math.radians(0.3), 0.05, 0.05])
    bias = switch_on + warm[:, None] * TEMPCO * rng.normal(1.0, 0.4, 3)
    bias += np.cumsum(rng.normal(0.0, 1.0, (n, 3)) * walk, axis=0)
    bias[:, 0] += lab.gyro_warm_up_rad_s * (1.0 - np.exp(-t / 120.0))
    read = np.column_stack([scale * omega, (matrix @ felt + _knocks(lab, rng, truth)).T]) + bias
    bandwidth = (lab.gyro_bandwidth_hz, lab.acc_bandwidth_hz, lab.acc_bandwidth_hz)
    noise = (lab.gyro_noise, lab.acc_noise, lab.acc_noise)
    lsb = np.array([lab.gyro_lsb, lab.acc_lsb, lab.acc_lsb])
    seen = np.column_stack([_low_pass(read[:, k], bandwidth[k]) for k in range(3)])
    polls = np.round((seen + rng.normal(0.0, noise, (n, 3))) / lsb) * lsb
    each = lab.packet_polls
    packets = polls[: n // each * each].reshape(-1, each, 3).mean(axis=1)
    ends = np.arange(1, len(packets) + 1) * each * POLL_S
    stamps = ends + rng.normal(0.0, 3e-4 * min(1.0, each / 10), len(ends))
    warmth = 24.0 + np.round(warm[each - 1 :: each][: len(ends)] / 0.1453) * 0.1453
    imu = np.column_stack([stamps, packets, warmth])
    if lab.faults:
        imu = _break_packets(lab, rng, imu, each * POLL_S)
    return imu[np.argsort(imu[:, 0], kind="stable")], bias


def _felt(lab: Laboratory, truth: dict[str, Array]) -> Array:
    """Return the specific force (2, n) at the centre of mass, body axes."""
    heading = 0.5 * (truth["theta"][1:] + truth["theta"][:-1])
    c, s = np.cos(heading), np.sin(heading)
    felt = truth["acc"] - truth["slope"]
    standing = round(lab.run_start_s / POLL_S)
    felt[:standing] = -truth["slope"][:standing]
    return np.array([c * felt[:, 0] + s * felt[:, 1], c * felt[:, 1] - s * felt[:, 0]])


def _knocks(lab: Laboratory, rng: np.random.Generator, truth: dict[str, Array]) -> Array:
    """Return what the accelerometers (2, n) read besides, while valves open and now and then in flight."""
    n = len(truth["alpha"])
    out = np.zeros((2, n))
    flying = np.arange(n) >= lab.run_start_s / POLL_S
    strays = np.nonzero(flying & (rng.random(n) < lab.stray_knock_hz * POLL_S))[0]
    for i in np.concatenate([np.nonzero(truth["opened"])[0], strays]):
        angle = rng.uniform(0.0, 2.0 * math.pi)
        size = lab.knock_m_s2 * (1.0 if truth["opened"][i] else rng.uniform(0.3, 1.0))
        out[:, i : i + KNOCK_POLLS] += size * np.array([[math.cos(angle)], [math.sin(angle)]])
    return out


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


def see_stars(
    lab: Laboratory, rng: np.random.Generator, truth: dict[str, Array]
) -> tuple[Array, list[list[object]]]:
    """Return rows of fixes in order of arrival, and which of them are wrong."""
    rows: list[list[float]] = []
    wrong: list[tuple[int, str]] = []
    grid = np.arange(len(truth["theta"])) * POLL_S
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
            pose += rng.normal(0.0, 1.0, 3) * [
                lab.star_sigma_xy,
                lab.star_sigma_xy,
                lab.star_sigma_heading,
            ]
            if lab.faults and rng.random() < lab.wrong_share:
                if rng.random() < 0.75:
                    wrong.append((len(rows), "gross"))
                    pose += rng.uniform(-1, 1, 3) * [0.8, 0.8, math.pi]
                else:
                    wrong.append((len(rows), "subtle"))
                    angle = rng.uniform(0, 2 * math.pi)
                    pose += [
                        0.03 * math.cos(angle),
                        0.03 * math.sin(angle),
                        rng.normal(0, 0.006),
                    ]
            pose[2] = math.remainder(pose[2], 2 * math.pi)
            rows.append(
                [
                    round(seen + rng.normal(0.0, lab.stamp_jitter_s), 6),
                    seen + late,
                    *pose,
                ]
            )
        exposure += late + rng.uniform(0.0, 0.1)  # the next whole frame, and what the computer does besides
    return np.array(rows), [[rows[index][0], kind] for index, kind in wrong]
