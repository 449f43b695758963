"""What is done to a vehicle during its rest does not enter its zero offsets."""

import math
from dataclasses import fields as fields_of
from pathlib import Path

import numpy as np

from groundstation.parts.fusion.messages import FusionStatus
from groundstation.parts.imu.messages import Imu
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.valves.messages import ValveStatus
from groundstation.rig.plan import make_node
from groundstation.rig.read import load_rig

RIG = Path(__file__).parents[5] / "examples" / "rigs" / "drawn_fixes.toml"
MS = 1_000_000
NULL = np.array((0.03, 0.04, -0.02))


def make(kind, fields):
    """A message of zeros but for these fields."""
    return kind(*[fields.get(field.name, 0) for field in fields_of(kind)])


def rested(push, until_s=12.0):
    """What a fusion node states during a rest in which a hand pushes: (3,) on top of the readings by time."""
    node = make_node(load_rig(RIG), "alpha/fusion")
    rng = np.random.default_rng(3)
    sigma = np.array((6.7e-4, 6.5e-4, 6.5e-4))
    seen = []
    for t_ms in range(10, round(until_s * 1e3) + 1, 10):
        now_ns = t_ms * MS
        if t_ms % 100 == 10:
            landed = make(ValveStatus, {"stamp_ns": now_ns, "vehicle": "alpha", "floating": False})
            list(node.receive(landed, now_ns))
        rate, ax, ay = NULL + push(t_ms * 1e-3) + sigma * rng.standard_normal(3)
        imu = {
            "stamp_ns": now_ns, "vehicle": "alpha", "tick_ms": t_ms, "elapsed_ms": 10 * (t_ms > 10),
            "window_s": 0.01, "rate_body_rad_s": rate, "force_body_m_s2": (ax, ay),
            "temperature_c": math.nan, "valid": True, "reason": "", "usable": 7,
        }  # fmt: skip
        list(node.receive(make(Imu, imu), now_ns))
        if t_ms % 500 == 0:
            x_m, y_m, heading_rad = 2e-4 * rng.standard_normal(3)
            fix = {
                "stamp_ns": now_ns - 50 * MS, "vehicle": "alpha", "fix": True, "x_m": x_m, "y_m": y_m,
                "heading_rad": heading_rad, "covariance": tuple((4e-8 * np.eye(3)).ravel()),
                "mode": "external", "reason": "",
            }  # fmt: skip
            list(node.receive(make(StarFix, fix), now_ns))
        if t_ms % 200 == 0:
            seen += [message for message in node.tick(now_ns) if isinstance(message, FusionStatus)]
    return seen


def test_a_bump_begins_the_rest_anew_and_stays_out_of_the_zero_offsets():
    def bump(t_s):
        return np.array((0.05, 0.06, -0.06)) * math.sin(20.0 * t_s) ** 2 * (4.0 < t_s < 4.6)

    quiet, bumped = rested(lambda _t_s: np.zeros(3)), rested(bump)
    assert quiet[-1].rest_s > 11.9
    assert 6.0 < bumped[-1].rest_s < 6.6
    lengths = [row.rest_s for row in bumped]
    assert lengths[19] > 3.9
    assert lengths[20:25] == [0.0] * 5
    for row in (quiet[-1], bumped[-1]):
        assert abs(row.bias_rate_rad_s - NULL[0]) < 1e-4
        assert np.abs(np.subtract(row.bias_force_m_s2, NULL[1:])).max() < 2e-4
