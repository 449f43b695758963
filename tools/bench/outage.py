"""A star outage of 10 s while a station is kept: the largest excursion by truth, over seeds, in lockstep.

The default rig's camera is replaced by drawn fixes of its rate and accuracy: an outage hides the pictures.
"""

import math
from pathlib import Path

import numpy as np

from bench.rows import RIGS, Bench, Row
from groundstation.bus.envelope import Delivered
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Supervision
from groundstation.rig.read import parse_rig, read_text
from groundstation.runners.make_runner import make_runner

SEEDS = 20
OUTAGE_S, SETTLED_S, SPREAD_S, AFTER_S = 10.0, 40.0, 5.0, 3.0
DEFAULT = "default rig"


class _Farthest:
    """Sees how far a vehicle gets from its hold pose, by truth, from a moment on."""

    def __init__(self, hold_m: tuple[float, float], from_ns: int) -> None:
        self.farthest_m = 0.0
        self.landed = False
        self._hold_m, self._from_ns = hold_m, from_ns

    def __call__(self, delivered: Delivered, now_ns: int) -> None:
        message = delivered.payload
        if now_ns < self._from_ns:
            return
        if isinstance(message, ReferenceState) and message.vehicle == "alpha":
            self.farthest_m = max(self.farthest_m, math.dist(message.position_table_m, self._hold_m))
        elif isinstance(message, Supervision) and message.vehicle == "alpha":
            self.landed |= message.mode not in ("flying",)


def measure(bench: Bench) -> list[Row]:
    """RMS and worst of the published rig, worst of the default one."""
    published = np.array([_fly(bench, "published rig", seed) for seed in range(1, SEEDS + 1)])
    default = np.array([_fly(bench, DEFAULT, seed) for seed in range(1, SEEDS + 1)])
    rms_mm = float(np.sqrt(np.mean(published**2)))
    what = "star outage of 10 s, station keeping, largest excursion by truth"
    return [
        Row(f"{what}: published rig, RMS of seeds", "30 mm (aim 24)", f"{rms_mm:.1f} mm", rms_mm <= 30.0),
        Row(
            f"{what}: published rig, worst seed",
            "75 mm (aim 50)",
            f"{published.max():.1f} mm",
            bool(published.max() <= 75.0),
        ),
        Row(
            f"{what}: default rig, worst seed",
            "40 mm (aim 20)",
            f"{default.max():.1f} mm",
            bool(default.max() <= 40.0),
        ),
    ]


def _fly(bench: Bench, what: str, seed: int) -> float:
    rng = np.random.default_rng(seed)
    start_s = SETTLED_S + float(rng.uniform(0.0, SPREAD_S))
    text = _default() if what == DEFAULT else read_text(RIGS / "published_condition.toml")
    text += (
        f'\n[[laboratory.failures]]\nkind = "dead_sky"\nvehicle = "alpha"\n'
        f"start_s = {start_s:.3f}\nend_s = {start_s + OUTAGE_S:.3f}\n"
    )
    rig = parse_rig(text, Path(RIGS / "outage.toml"))
    hold = rig.vehicles["alpha"].hold
    farthest = _Farthest((hold.x_m, hold.y_m), round(start_s * 1e9))
    bench.say(f"outage, {what}, seed {seed} of {SEEDS}")
    runner = make_runner(rig, seed, [farthest], journaled=False)
    try:
        runner.run(round((start_s + OUTAGE_S + AFTER_S) * 1e9))
    finally:
        runner.close()
    assert not farthest.landed, "it did not fly through the outage"
    return 1e3 * farthest.farthest_m


def _default() -> str:
    """The default rig with drawn fixes in place of its cameras."""
    text = read_text(RIGS / "two_mock_ups.toml")
    kept = []
    for line in text.splitlines():
        if line.startswith("star_camera ="):
            line = line.replace("star_camera =", "fixes =").replace("star_camera", "fixes")
        if line.startswith("camera = {"):
            line = (
                'camera = { source = "fixes", rate_hz = 15.0, delay_s = 0.015, '
                "sigma_xy_m = 0.0002, sigma_heading_rad = 0.0002 }"
            )
        kept.append(line)
    return "\n".join(kept) + "\n"
