"""The truth of a generated fusion data set: a controller, eight valves, a rigid body on a wavy table."""

from __future__ import annotations

import math

import numpy as np
from fusion_laboratory import POLL_S, Array, Laboratory, Table, goal_at

CONTROL_POLLS = 200


def _valves(rng: np.random.Generator) -> tuple[Array, Array]:
    """Return (8, 3) force x, y and torque per valve, and (8,) their thrusts' ratios."""
    arm = 0.15
    layout = [(1, 0, 0, arm), (1, 0, 0, -arm), (-1, 0, 0, arm), (-1, 0, 0, -arm)]
    layout += [(0, 1, arm, 0), (0, 1, -arm, 0), (0, -1, arm, 0), (0, -1, -arm, 0)]
    rows = [(fx, fy, x * fy - y * fx) for fx, fy, x, y in layout]
    return 0.22 * np.array(rows, float), rng.normal(1.0, 0.03, 8)


def fly(lab: Laboratory, rng: np.random.Generator, table: Table) -> dict[str, Array]:
    """Integrate the truth at 1 kHz; arrays at the polls, accelerations as means over each poll."""
    n = round(lab.duration_s / POLL_S)
    out = {k: np.zeros((n + 1, 2)) for k in ("p", "v")} | {k: np.zeros(n + 1) for k in ("theta", "omega")}
    acc, alpha, slope = np.zeros((n, 2)), np.zeros(n), np.zeros((n, 2))
    mask, opened = np.zeros(n, int), np.zeros(n, bool)
    pull, ratio = _valves(rng)
    mass, inertia, min_on = 11.0, 0.25, 0.010
    perimeter = lab.scenario in ("perimeter", "outage")
    start = np.array(
        [
            *((-0.72, -0.5) if perimeter else rng.uniform(-0.25, 0.25, 2)),
            rng.normal(0.0, 0.02),
        ]
    )
    p, v, theta, omega = start[:2].copy(), np.zeros(2), float(start[2]), 0.0
    level = np.zeros(8)
    first = round(lab.run_start_s / POLL_S)
    if lab.scenario == "drift":
        v_start, w_start = (
            rng.uniform(-0.008, 0.008, 2),
            rng.uniform(-0.03, 0.03),
        )  # a push of 0.2 s
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
            pose, rate = goal_at(lab, t, start)
            seen_p = p + rng.normal(0.0, 1.5e-3, 2)
            seen_v = v + rng.normal(0.0, 1.0e-3, 2)
            wanted_v += np.clip(rate[:2] - wanted_v, -0.006, 0.006)
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
        opened[i + 1 : i + m] = (open_[1:] & ~open_[:-1]).any(axis=1)
        sag = 1.0 - 0.03 * np.maximum(0, open_.sum(axis=1) - 1)
        wrench = (force * ratio * sag[:, None]) @ pull
        if lab.scenario == "drift" and i == first:
            c, s = math.cos(theta), math.sin(theta)
            push = mass * v_start / (m * POLL_S)
            wrench += [
                c * push[0] + s * push[1],
                c * push[1] - s * push[0],
                inertia * w_start / (m * POLL_S),
            ]
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
    return out | {
        "acc": acc,
        "alpha": alpha,
        "slope": slope,
        "mask": mask,
        "opened": opened,
    }
