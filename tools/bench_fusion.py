"""Print the fusion's accuracy and speed beside the published method's, on files and on generated seeds.

    python tools/bench_fusion.py                     six seeds per scenario of tools/fusion_truth.py
    python tools/bench_fusion.py --samples FOLDER    also every data set with truth below FOLDER

Figures are those of the data sets' scorer: RMS over the flight from 10 s after its start, in a star outage
only before and after it; over seeds the RMS of RMS, the mean of p99. Wall clocks on a shared machine are
noisy, so times are process time. filterpy is a peer when it is installed (`pip install filterpy`).
"""

from __future__ import annotations

import argparse
import math
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tools")]

import fusion_truth  # noqa: E402 - the path is set just above
from fusion_peers import peers  # noqa: E402

from groundstation.cli.fusion import estimate  # noqa: E402
from groundstation.cli.fusion_folder import FusionFolder, read_folder  # noqa: E402
from groundstation.fusion.error_state_filter import ErrorStateFilter  # noqa: E402
from groundstation.fusion.estimator import Estimator, Fix, ImuPacket, PlanarState  # noqa: E402
from groundstation.fusion.offline import OfflineSmoother  # noqa: E402
from groundstation.fusion.reintegration import ReintegrationEstimator  # noqa: E402

Array = NDArray[np.float64]
SETTLE_S = 10.0
SCENARIOS = {"station": 100.0, "drift": 100.0, "spin": 70.0, "perimeter": 130.0, "outage": 100.0}
LIMITS = {  # issue table: position mm, p99 mm, velocity mm/s, heading deg; must and aim
    "station": ((1.6, 3.8, 0.75, 0.027), (1.25, 3.0, 0.5, 0.024)),
    "drift": ((1.8, 4.3, 0.9, 0.027), (1.35, 3.2, 0.6, 0.024)),
    "spin": ((1.8, 4.3, 0.9, 0.037), (1.35, 3.2, 0.6, 0.026)),
    "perimeter": ((2.1, 5.2, 1.3, 0.027), (1.45, 3.5, 0.85, 0.024)),
}


@dataclass(frozen=True)
class Figures:
    """One run against its truth."""

    position_mm: float
    p99_mm: float
    velocity_mm_s: float
    heading_deg: float
    outage_end_mm: float
    wrong_used: int
    good_refused: int
    nis: float
    inside: Array
    """Share of x, y and heading errors within 1, 2, 3 reported sigmas."""


def judge(folder: Path, data: FusionFolder, states: list[PlanarState | None], accounts: list) -> Figures:
    """Compare with truth as the data sets' scorer does."""
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    meta = fusion_truth.json.loads((folder / "meta.json").read_text())["truth"]
    t = data.imu[:, 0]
    got = np.array([(math.nan,) * 12 if s is None else s[1:13] for s in states])
    want = np.column_stack([np.interp(t, truth["t_s"], truth[k])
                            for k in ("x_m", "y_m", "heading_rad", "vx_m_s", "vy_m_s")])  # fmt: skip
    off = got[:, :5] - want
    off[:, 2] = np.remainder(off[:, 2] + math.pi, 2 * math.pi) - math.pi
    start = 0.0 if meta["config"]["mode"] == "rest" else data.run_start_s
    rows = (t >= start + SETTLE_S) & (t <= truth["t_s"][-1]) & np.isfinite(off).all(axis=1)
    end_mm = math.nan
    if meta["config"]["outage"]:
        began, stopped = meta["config"]["outage"]
        back = data.stars[data.stars[:, 0] > stopped, 1].min()
        last = np.nonzero(t < back)[0][-1]
        end_mm = 1e3 * float(np.hypot(*off[last, :2]))
        rows &= ~((t > began) & (t < back + 2.0))
    wrong = np.array([w[0] for w in meta["wrong_fixes"]])
    stamps = np.array([a.t_exposure_ns * 1e-9 for a in accounts])
    is_wrong = np.array([len(wrong) > 0 and np.abs(wrong - s).min() < 1e-5 for s in stamps])
    used = np.array([a.used for a in accounts])
    nis = [a.nis for a in accounts if a.reason == "used" and math.isfinite(a.nis)]
    position = 1e3 * np.hypot(off[rows, 0], off[rows, 1])
    ratio = np.abs(off[rows, :3]) / got[rows, 9:12]
    return Figures(
        float(np.sqrt(np.mean(position**2))), float(np.percentile(position, 99)),
        1e3 * float(np.sqrt(np.mean(off[rows, 3] ** 2 + off[rows, 4] ** 2))),
        math.degrees(float(np.sqrt(np.mean(off[rows, 2] ** 2)))), end_mm,
        int((is_wrong & used).sum()), int((~is_wrong & ~used & (stamps < t[-1] - 1.0)).sum()),
        float(np.mean(nis)) if nis else math.nan,
        np.array([(ratio < k).mean() for k in (1, 2, 3)]),
    )  # fmt: skip


def run(folder: Path, method: str, factory: object) -> Figures:
    """Run one method on one data set."""
    data = read_folder(folder)
    estimator = factory(data.noise)  # type: ignore[operator]  # a row of the table below
    states, accounts = estimate(data, estimator)
    if method == "smoother":
        states = estimator.states()
    return judge(folder, data, states, accounts)


def line(name: str, method: str, figures: list[Figures]) -> str:
    """Return one row of the table."""

    def over(field: str) -> float:
        return math.sqrt(float(np.mean([getattr(f, field) ** 2 for f in figures])))

    inside = 100 * np.mean([f.inside for f in figures], axis=0)
    p99 = float(np.mean([f.p99_mm for f in figures]))
    text = (
        f"{name:18s} {method:14s} {over('position_mm'):8.2f} {p99:8.2f} {over('velocity_mm_s'):8.2f}"
        f" {over('heading_deg'):8.4f} {np.mean([f.nis for f in figures]):6.2f}"
        f"   {inside[0]:3.0f} {inside[1]:3.0f} {inside[2]:4.1f}"
        f"   {sum(f.wrong_used for f in figures):4d} {sum(f.good_refused for f in figures):4d}"
    )
    ends = [f.outage_end_mm for f in figures if math.isfinite(f.outage_end_mm)]
    return text + (f"   outage ends at {math.sqrt(float(np.mean(np.square(ends)))):.1f} mm" if ends else "")


def speed(folder: Path) -> None:
    """Print process time per packet and per late fix, and of the whole command."""
    data = read_folder(folder)
    packets = [ImuPacket(round(r[0] * 1e9), 0.01, *r[1:5]) for r in data.imu.tolist()]
    cov = np.diag([data.noise.star_sigma_xy_m**2] * 2 + [data.noise.star_sigma_heading_rad**2])
    best = [math.inf, math.inf]
    for _ in range(5):
        estimator: Estimator = ErrorStateFilter(data.noise)
        estimator.begin_rest(0)
        spent, k = [0.0, 0.0], 0
        is_resting = True
        for row in data.stars.tolist():
            first = k
            while k < len(packets) and packets[k].t_ns < row[1] * 1e9:
                k += 1
            began = process_time()
            for packet in packets[first:k]:
                estimator.add_imu(packet)
            spent[0] += process_time() - began
            if is_resting and row[1] > data.run_start_s:
                estimator.end_rest(round(data.run_start_s * 1e9))
                is_resting = False
            fix = Fix(round(row[0] * 1e9), round(row[1] * 1e9), row[2], row[3], row[4], cov)
            began = process_time()
            estimator.add_fix(fix)
            spent[1] += process_time() - began
        best = [min(best[0], spent[0] / k), min(best[1], spent[1] / len(data.stars))]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "groundstation.cli.main", "fusion", "run", str(folder)]
    with tempfile.TemporaryDirectory() as place:
        subprocess.run([*command, "--out", f"{place}/e.csv"], check=True, capture_output=True, cwd=ROOT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    whole = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(
        f"{1e6 * best[0]:.2f} us a packet (must 5, aim 2.5), {1e3 * best[1]:.3f} ms a late fix (0.5, 0.25), ",
        end="",
    )
    print(f"{whole:.2f} s the whole command on {data.imu[-1, 0]:.0f} s of data (3, 1)")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Accuracy and speed of the fusion.")
    parser.add_argument("--samples", type=Path, help="folder of data sets with truth")
    parser.add_argument("--seeds", type=int, default=6)
    arguments = parser.parse_args()
    methods = {
        "filter": ErrorStateFilter,
        "published": ReintegrationEstimator,
        "smoother": OfflineSmoother,
    } | peers()
    print(f"{'data':18s} {'method':14s} {'pos mm':>8s} {'p99 mm':>8s} {'mm/s':>8s} {'deg':>8s} {'NIS':>6s}"
          "   in 1 2 3 sigma %   wrong used, good refused")  # fmt: skip
    if arguments.samples:
        for folder in sorted(p.parent for p in arguments.samples.glob("*/truth.csv")):
            for method, factory in methods.items():
                print(line(folder.name, method, [run(folder, method, factory)]), flush=True)
    with tempfile.TemporaryDirectory() as place:
        rows = [(name, seconds, 0.02) for name, seconds in SCENARIOS.items()]
        for name, seconds, wrong in [*rows, ("perimeter", 130.0, 0.1)]:
            folders = []
            for seed in range(201, 201 + arguments.seeds):
                folders.append(Path(place) / f"{name}{wrong}-{seed}")
                lab = fusion_truth.Laboratory(scenario=name, seed=seed, duration_s=seconds, wrong_share=wrong)
                fusion_truth.write(fusion_truth.make(lab), folders[-1])
            label = name if wrong == 0.02 else f"{name} 10% wrong"
            for method, factory in methods.items():
                print(line(label, method, [run(f, method, factory) for f in folders]), flush=True)
            if wrong == 0.02 and name in LIMITS:
                for word, row in zip(("must", "aim"), LIMITS[name], strict=True):
                    print(f"{'':18s} {word:14s} {row[0]:8.2f} {row[1]:8.2f} {row[2]:8.2f} {row[3]:8.4f}")
        speed(Path(place) / "station0.02-201")


if __name__ == "__main__":
    main()
