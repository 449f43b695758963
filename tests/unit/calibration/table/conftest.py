"""A made-up table and vehicles that fly laps over it, with truth; it shares no line with the package."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration.table.flight_log import FlightLog

Array = NDArray[np.float64]


@dataclass
class MadeTable:
    """A mean slope and plane waves of height, pulling as gravity does."""

    slope: Array
    wave_rad_m: Array
    phase: Array
    amplitude: Array

    @classmethod
    def drawn(
        cls, rng: np.random.Generator, waviness: float = 4e-4, slope: tuple[float, float] = (3e-3, -1e-3)
    ):
        n = 10
        angle = np.pi * (np.arange(n) + rng.uniform(size=n)) / n
        k = 2.0 * np.pi / rng.uniform(0.7, 2.2, n)
        wave = k[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        return cls(np.array(slope), wave, rng.uniform(0, 2 * np.pi, n), 2.0 * waviness / math.sqrt(n) / k)

    def pull(self, p: Array) -> Array:
        return self.slope + np.cos(p @ self.wave_rad_m.T + self.phase) * self.amplitude @ self.wave_rad_m


def fly(
    table: MadeTable,
    rng: np.random.Generator,
    *,
    laps: int = 2,
    turning: float = 1.0,
    fix_sigma_m: float = 3e-4,
    fix_rate_hz: float = 3.0,
    name: str = "lap",
) -> FlightLog:
    """A rest of 5 s, then smooth laps that sweep a 3 m x 2 m table, 50 packets a second."""
    dt, rest_s = 0.02, 5.0
    t_end = rest_s + 100.0 * laps
    t = np.arange(0.0, t_end, dt) + dt
    fine = np.arange(0.0, t_end + 1e-9, dt / 4.0)
    since = np.clip(fine - rest_s, 0.0, None)
    phase = 2.0 * np.pi / 100.0 * np.where(since < 10.0, since**2 / 20.0, since - 5.0)  # begins gently
    turn = rng.uniform(0.0, 2.0 * np.pi, 2)
    x = 1.2 * np.sin(phase + turn[0]) + 0.1 * np.sin(3.1 * phase)
    y = 0.75 * np.sin((2.0 + 0.37) * phase + turn[1])
    p = np.column_stack([x, y])
    heading = 0.3 + turning * phase
    v = np.gradient(p, fine, axis=0)
    a = np.gradient(v, fine, axis=0)
    flying = fine > rest_s
    a[~flying] = 0.0
    felt = a - table.pull(p)
    c, s = np.cos(heading), np.sin(heading)
    body = np.column_stack([c * felt[:, 0] + s * felt[:, 1], c * felt[:, 1] - s * felt[:, 0]])
    arm = np.array([0.03, -0.02])
    rate = np.gradient(heading, fine)
    alpha = np.gradient(rate, fine)
    body += np.column_stack([-alpha * arm[1] - rate**2 * arm[0], alpha * arm[0] - rate**2 * arm[1]])
    bias = rng.normal(0.0, 0.03, 2)
    density = 6.5e-5
    packets = body[:-1].reshape(-1, 4, 2).mean(axis=1) * 0.5 + body[1:].reshape(-1, 4, 2).mean(axis=1) * 0.5
    packets = packets + bias + rng.normal(0.0, density / math.sqrt(dt), packets.shape)
    n = len(packets)
    t, middle = t[:n], fine[2::4][:n]
    exposures = np.arange(0.25, t_end - 0.1, 1.0 / fix_rate_hz)
    seen = np.column_stack([np.interp(exposures, fine, p[:, k]) for k in (0, 1)])
    speed = np.column_stack([np.interp(exposures, fine, v[:, k]) for k in (0, 1)])
    k = len(exposures)
    return FlightLog(
        name, t, np.full(n, dt), packets, np.zeros(n),
        np.interp(middle, fine, heading), np.column_stack([np.interp(middle, fine, p[:, i]) for i in (0, 1)]),
        np.zeros(n, dtype=np.bool_), exposures, seen + rng.normal(0.0, fix_sigma_m, seen.shape),
        np.broadcast_to(np.eye(2) * fix_sigma_m**2, (k, 2, 2)).copy(),
        np.interp(exposures, fine, heading), speed, ((0.0, rest_s),), (0.03, -0.02), density,
    )  # fmt: skip


@pytest.fixture
def made_table() -> MadeTable:
    return MadeTable.drawn(np.random.default_rng(3))


@pytest.fixture
def made_table_of():
    """Draws a table from a generator."""
    return MadeTable.drawn


@pytest.fixture(name="fly")
def _fly():
    """Flies laps over a table."""
    return fly
