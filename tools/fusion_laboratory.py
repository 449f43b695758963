"""A laboratory to fly fusion data sets in: its settings, its table and where its vehicle is sent."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
G = 9.80665
SCENARIOS = ("rest", "station", "drift", "perimeter", "spin", "outage", "warmup")
POLL_S = 1e-3
LAP_M = ((0.0, 0.0), (1.5, 0.0), (1.5, 1.08), (0.0, 1.08))
"""Corners of a lap, from the start."""
LAP_SPEED_M_S = 0.0645
LAP_TURN_S = 6.3
ROUND_S = 1.6
"""Before and after a corner in which the speed goes over from one leg to the next."""
SETTLE_S = 5.0
"""A lap's goal sets out gently."""


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
    knock_m_s2: float = 0.027
    """What the accelerometers read, in any direction, for 3 ms when valves open; nothing moves by it."""
    stray_knock_hz: float = 0.7
    """The same at other moments of the flight, often weaker."""
    gyro_warm_up_rad_s: float = 0.0
    """How far the gyro's null creeps after switching on, over some minutes."""
    outage_s: tuple[float, float] | None = None
    """Without stars; a scenario "outage" without it has (55, 65)."""
    table_seed: int | None = None
    """The same table under other noise, for maps."""
    faults: bool = True
    acc_matrix_sigma: float = 0.006
    """Of the accelerometers' scale and of the angles between their axes and the body's."""
    waviness_m_s2: tuple[float, float] = (1.3e-4, 2.8e-4)
    """Range of the RMS of the table's waves, per axis."""


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


def goal_at(lab: Laboratory, t: float, start: Array) -> tuple[Array, Array]:
    """Return pose (x, y, heading) and its rate wanted at `t` after the start of the run."""
    if lab.scenario == "drift":
        return start, np.zeros(3)
    share, share_rate = min(1.0, t / 15.0), (t < 15.0) / 15.0
    if lab.scenario in ("station", "warmup"):
        step = np.array([0.05, -0.24, 0.3]) if t < 400.0 else np.array([0.2, 0.1, -0.4])
        return start + step * share, step * share_rate
    if lab.scenario == "spin":
        period, top = 24.0, 0.78
        step = np.array([-0.1, -0.18, 0.0])
        spin = np.array([0.0, 0.0, top if (t % period) < 12.0 else -top])
        return start + step * share, spin + step * share_rate
    return _lap(t, start)


def _lap(t: float, start: Array) -> tuple[Array, Array]:
    """Return pose and rate on laps around a rectangle, corners rounded, the heading turning after them."""
    corners = np.array(LAP_M)
    gently = math.exp(-t / SETTLE_S)
    along = LAP_SPEED_M_S * (t - SETTLE_S * (1.0 - gently))
    speed = LAP_SPEED_M_S * (1.0 - gently)
    leg = 0
    while along > _leg_m(corners, leg):
        along -= _leg_m(corners, leg)
        leg += 1
    since, until = along / LAP_SPEED_M_S, (_leg_m(corners, leg) - along) / LAP_SPEED_M_S
    place, v = corners[leg % 4] + _way(corners, leg) * along, _way(corners, leg) * speed
    if until < ROUND_S or (leg > 0 and since < ROUND_S):
        entered = leg - (until >= ROUND_S)
        s = -until if until < ROUND_S else since
        v_in, v_out = _way(corners, entered) * speed, _way(corners, entered + 1) * speed
        place = corners[(entered + 1) % 4] + (v_out * (ROUND_S + s) ** 2 - v_in * (ROUND_S - s) ** 2) / (
            4.0 * ROUND_S
        )
        v = (v_in * (ROUND_S - s) + v_out * (ROUND_S + s)) / (2.0 * ROUND_S)
    turned, rate = float(leg), 0.0
    share = since / LAP_TURN_S
    if leg > 0 and share < 1.0:
        turned = leg - 1 + share**2 * (3.0 - 2.0 * share)
        rate = 6.0 * share * (1.0 - share) / LAP_TURN_S
    quarter = math.pi / 2.0
    return np.array([*(start[:2] + place), start[2] + turned * quarter]), np.array([*v, rate * quarter])


def _leg_m(corners: Array, leg: int) -> float:
    return float(np.hypot(*(corners[(leg + 1) % 4] - corners[leg % 4])))


def _way(corners: Array, leg: int) -> Array:
    return np.asarray((corners[(leg + 1) % 4] - corners[leg % 4]) / _leg_m(corners, leg))
