"""Errors of one run against its truth, as the data sets' scorer takes them."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.fusion.estimator import EstimatorFactory, FixOutcome, PlanarState
from groundstation.fusion.flight_data import FlightData, estimate
from groundstation.fusion.offline import OfflineSmoother

Array = NDArray[np.float64]
SETTLE_S = 10.0
"""Left out after the start of the motion."""
AFTER_OUTAGE_S = 2.0
SAME_STAMP_S = 1e-5
LAST_S = 1.0
"""A fix in the last second may wait for packets that never come."""
_TRUE = ("x_m", "y_m", "heading_rad", "vx_m_s", "vy_m_s")


@dataclass(frozen=True, slots=True, eq=False)
class Figures:
    """One run; an outage is left out until 2 s after the first fix back, and told apart.

    Attributes:
        position_mm: RMS distance.
        p99_mm: 99th percentile of the distance.
        velocity_mm_s: RMS.
        heading_deg: RMS.
        outage_end_mm: Distance just before the first fix after an outage; NaN without one.
        wrong_used: Wrong fixes that were used.
        wrong: Wrong fixes.
        good_refused: Good fixes that were refused.
        nis: Mean normalised innovation squared of the used fixes, 3 expected.
        inside_place: Share of x and y errors within 1, 2, 3 reported sigmas.
        inside_heading: The same of the heading.
        packets_without: Packets after settling for which there was no estimate.
    """

    position_mm: float
    p99_mm: float
    velocity_mm_s: float
    heading_deg: float
    outage_end_mm: float
    wrong_used: int
    wrong: int
    good_refused: int
    nis: float
    inside_place: Array
    inside_heading: Array
    packets_without: int


def flown(folder: Path, factory: EstimatorFactory, *, is_cleaned: bool = False) -> Figures:
    """Run one method on one data set and judge it.

    Args:
        folder: The data set.
        factory: Of the estimator.
        is_cleaned: Whether the wrong fixes are taken out for it, who could not know them.
    """
    data = read_folder(folder)
    if is_cleaned:
        data = replace(data, stars=data.stars[~_is_wrong(data.stars[:, 0], _truth_of(folder)["wrong_fixes"])])
    estimator = factory(data.noise)
    states, accounts = estimate(data, estimator)
    if isinstance(estimator, OfflineSmoother):
        later = iter(estimator.states())
        states = [next(later) if math.isfinite(t) else None for t in data.imu[:, 0]]
    return judge(folder, data, states, accounts)


def judge(
    folder: Path, data: FlightData, states: Sequence[PlanarState | None], accounts: Sequence[FixOutcome]
) -> Figures:
    """Compare with truth.csv and the truth block of meta.json."""
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    meta = _truth_of(folder)
    t = data.imu[:, 0]
    got = np.array([(math.nan,) * 12 if state is None else state[1:13] for state in states])
    want = np.column_stack([np.interp(t, truth["t_s"], truth[name]) for name in _TRUE])
    off = got[:, :5] - want
    off[:, 2] = np.remainder(off[:, 2] + math.pi, 2 * math.pi) - math.pi
    start = 0.0 if meta["config"]["mode"] == "rest" else data.run_start_s
    rows = (t >= start + SETTLE_S) & (t <= truth["t_s"][-1])
    end_mm = math.nan
    if meta["config"]["outage"]:
        began, stopped = meta["config"]["outage"]
        back = data.stars[data.stars[:, 0] > stopped, 1].min()
        end_mm = 1e3 * float(np.hypot(*off[np.nonzero(t < back)[0][-1], :2]))
        rows &= ~((t > began) & (t < back + AFTER_OUTAGE_S))
    without = int((rows & ~np.isfinite(off).all(axis=1)).sum())
    rows &= np.isfinite(off).all(axis=1)
    position = 1e3 * np.hypot(off[rows, 0], off[rows, 1])
    ratio = np.abs(off[rows, :3]) / got[rows, 9:12]
    wrong_used, wrong, good_refused = _fixes(meta["wrong_fixes"], accounts, t[-1])
    nis = [account.nis for account in accounts if account.reason == "used" and math.isfinite(account.nis)]
    return Figures(
        position_mm=_rms(position),
        p99_mm=float(np.percentile(position, 99)) if len(position) else math.nan,
        velocity_mm_s=1e3 * _rms(np.hypot(off[rows, 3], off[rows, 4])),
        heading_deg=math.degrees(_rms(off[rows, 2])),
        outage_end_mm=end_mm,
        wrong_used=wrong_used,
        wrong=wrong,
        good_refused=good_refused,
        nis=float(np.mean(nis)) if nis else math.nan,
        inside_place=np.array([(ratio[:, :2] < k).mean() for k in (1, 2, 3)]),
        inside_heading=np.array([(ratio[:, 2] < k).mean() for k in (1, 2, 3)]),
        packets_without=without,
    )


def _fixes(
    listed: Sequence[Sequence[float]], accounts: Sequence[FixOutcome], end_s: float
) -> tuple[int, int, int]:
    """Wrong fixes used, wrong fixes, good fixes refused."""
    stamps = np.array([account.t_exposure_ns * 1e-9 for account in accounts])
    used = np.array([account.used for account in accounts], dtype=bool)
    wrong = _is_wrong(stamps, listed)
    return (
        int((wrong & used).sum()),
        int(wrong.sum()),
        int((~wrong & ~used & (stamps < end_s - LAST_S)).sum()),
    )


def _truth_of(folder: Path) -> dict[str, Any]:
    """The truth block of meta.json."""
    truth: dict[str, Any] = json.loads((folder / "meta.json").read_text())["truth"]
    return truth


def _is_wrong(exposures_s: Array, listed: Sequence[Sequence[float]]) -> NDArray[np.bool_]:
    """Which exposures, shape (n,), are of wrong fixes."""
    wrong = np.zeros(len(exposures_s), dtype=bool)
    for row in listed:
        wrong |= np.abs(exposures_s - row[0]) < SAME_STAMP_S
    return wrong


def over_seeds(figures: Sequence[Figures], name: str) -> float:
    """RMS over runs of one figure."""
    return _rms(np.array([getattr(run, name) for run in figures]))


def p99_mm(figures: Sequence[Figures]) -> float:
    """Mean over runs of the 99th percentile of the distance."""
    return float(np.mean([run.p99_mm for run in figures]))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else math.nan
