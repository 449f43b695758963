"""Figure 2.15: how long the tips are recognised, against their size and against the camera."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.laboratory.separations import SeparationOrder
from groundstation.studies.chibis import condition
from groundstation.studies.chibis.condition import F_PX, SIZE_PX, simulation
from groundstation.studies.chibis.simulation import GAP, KINDS, SIDES, WORDS, simulate, tip_px
from groundstation.studies.plots import Axes, Line, over_time
from groundstation.studies.study import Drawn, Generated, Number, Progress

Floats = NDArray[np.float64]

STEP_S, END_S = 8.0, 1000.0
SIZES_MM = (2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0)
FOCI_PX = (350.0, 450.0, 550.0, 650.0, 750.0, 850.0, 950.0, 1050.0)
WIDTHS_PX = (540.0, 580.0, 620.0, 660.0, 700.0)
WIDE_TIP_M = 0.028
"""Of the sweep of the field of view: large enough that nothing else ends the work."""
FINENESS_PX = (320.0, 480.0, 640.0, 800.0, 960.0)
ASSUMED = (
    "the simulation ends after 1000 s",
    "a picture every 8 s; 40 s without a solved frame end the work",
)


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """One quantity varied.

    Attributes:
        values: Of it, (n,).
        working_s: Time of the last solved frame by side, (n,); 0 where the work never began.
        tips_px: Size of a tip there by side, (n,).
    """

    values: Floats
    working_s: Mapping[str, Floats]
    tips_px: Mapping[str, Floats]


def _size(width: float) -> tuple[int, int]:
    return round(width), round(width * SIZE_PX[1] / SIZE_PX[0])


def orders(step_s: float, end_s: float) -> dict[str, list[tuple[float, SeparationOrder]]]:
    """Every order by the name of its sweep, with the value that is varied."""
    return {
        "tips": [(mm, simulation(step_s, end_s, tip_m=1e-3 * mm)) for mm in SIZES_MM],
        "focus": [(f, simulation(step_s, end_s, f_px=f)) for f in FOCI_PX],
        "field": [
            (
                2.0 * np.degrees(np.arctan(0.5 * width / F_PX)),
                simulation(step_s, end_s, tip_m=WIDE_TIP_M, size_px=_size(width)),
            )
            for width in WIDTHS_PX
        ],
        "chip": [
            (width, simulation(step_s, end_s, size_px=_size(width), f_px=F_PX * width / SIZE_PX[0]))
            for width in FINENESS_PX
        ],
    }


def sweep_all(progress: Progress, step_s: float = STEP_S, names: Sequence[str] = ()) -> dict[str, Sweep]:
    """Run every sweep, or some."""
    gap_s = GAP * condition.STEP_S
    wanted = {name: rows for name, rows in orders(step_s, END_S).items() if not names or name in names}
    count, done = sum(map(len, wanted.values())), 0
    found = {}
    for name, rows in wanted.items():
        working: dict[str, list[float]] = {side: [] for side in SIDES}
        tips: dict[str, list[float]] = {side: [] for side in SIDES}
        for _, order in rows:

            def report(_: str, share: float, done: int = done, name: str = name) -> None:
                progress(f"working time against {name}", (done + share) / count)

            run = simulate(order, report)
            for side in SIDES:
                last = run.courses[side].last_solved(max(2, round(gap_s / step_s)))
                working[side].append(0.0 if last is None else float(order.times_s[last]))
                tips[side].append(np.nan if last is None else tip_px(run, side, last))
            done += 1
        found[name] = Sweep(
            np.array([value for value, _ in rows]),
            {side: np.array(working[side]) for side in SIDES},
            {side: np.array(tips[side]) for side in SIDES},
        )
    return found


WORKING_TIMES = Generated(sweep_all, 6.0)


def draw_working_time(data: Mapping[str, Mapping[str, Sweep]]) -> Drawn:
    """Figure 2.15, and the same for the camera."""
    sweeps = data["working times"]
    names = {
        "tips": ("diameter of a tip, mm", "Against the size of the tips, as published."),
        "focus": ("focal length, px", "Against the focal length; the chip stays, so the field narrows."),
        "field": (
            "field of view, deg",
            "Against the field of view: a wider chip behind the same lens; tips of 28 mm.",
        ),
        "chip": ("columns of the chip, px", "Against the chip: finer pixels, the same field of view."),
    }
    pictures = []
    for key, (along, caption) in names.items():
        if key not in sweeps:
            continue
        sweep = sweeps[key]
        lines = []
        for side in SIDES:
            lines.append(Line(WORDS[side], KINDS[side], sweep.values, sweep.working_s[side]))
            lines.append(Line("", KINDS[side], sweep.values, sweep.working_s[side], is_dots=True))
        top = 1.1 * max(float(sweep.working_s[side].max()) for side in SIDES)
        pictures.append(
            (
                caption,
                over_time(
                    [Axes("working time, s", lines, (0.0, max(top, 1.0)))],
                    float(sweep.values[0]),
                    float(sweep.values[-1]),
                    caption,
                    along=along,
                ),
            )
        )
    tips = sweeps["tips"]
    numbers = [
        Number.beside(
            "smallest tip that is followed at all, mm",
            float("nan"),
            [critical_mm(tips, side) for side in SIDES],
            f"published: a critical size exists, without a value; one pixel at 3 m is {3e3 / F_PX:g} mm",
        ),
        Number.beside(
            "tip at the last solved frame, px, mean over sizes",
            1.0,
            [_mean_px(tips, side) for side in SIDES],
            "published: one pixel; sizes that the field of view does not end",
            1.3,
        ),
    ]
    for mm in (8.0, 12.0, 16.0):
        at = SIZES_MM.index(mm)
        numbers.append(
            Number.beside(
                f"working time with tips of {mm:g} mm, s",
                float("nan"),
                [float(tips.working_s[side][at]) for side in SIDES],
            )
        )
    if "focus" in sweeps:
        focus = sweeps["focus"]
        numbers.append(
            Number.beside(
                "focal length of the longest work, px",
                float("nan"),
                [float(focus.values[np.argmax(focus.working_s[side])]) for side in SIDES],
                "longer: the target leaves the field of view before its tips are too small",
            )
        )
    words = (
        "The work ends where a tip is smaller than a pixel, so its distance is the focal length times the "
        "tip's diameter, and there is a size below which it never begins. The distance is proportional to "
        "the size, the time a little less; nothing in it is exponential. The largest tips are still seen "
        "when the target leaves the field of view. The published methods may end earlier, at one moment "
        "whatever the camera: where the microsatellite is turned by half a turn, the vector part of a "
        "quaternion is singular and Newton's method does not come to rest."
    )
    return Drawn(pictures, numbers, words)


def critical_mm(tips: Sweep, side: str) -> float:
    """The smallest diameter of the sweep with which a side works for more than a minute."""
    works = tips.values[tips.working_s[side] > 60.0]
    return float(works[0]) if len(works) else float("nan")


def _mean_px(tips: Sweep, side: str) -> float:
    own = (tips.working_s[side] > 60.0) & (tips.working_s[side] < 800.0)
    return float(tips.tips_px[side][own].mean()) if own.any() else float("nan")
