"""Figures 21 to 24: the joint method beside stars alone, their difference, and both beside the truth."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from groundstation.studies.air_table.estimates import (
    VX,
    VY,
    Array,
    X,
    Y,
    as_flown,
    at,
    estimated,
    off_truth,
    rms,
)
from groundstation.studies.flown import Flown, Sides
from groundstation.studies.plots import Axes, Line, over_time
from groundstation.studies.study import DEFAULT, PUBLISHED, Drawn, Number

NAN = math.nan
MOSTLY_M = 0.05
FROM_S = 5.0
SHOWN_S = (0.0, 175.0)
UNSTATED = (
    ("apart_mm", "joint minus stars, position, mm RMS", ""),
    ("lag_mm", "way within the age of what stars show, mm RMS", "0.04 m/s times 0.6 s and more"),
    ("off_mm", "joint off truth, position, mm RMS", "no truth was published"),
    ("stars_mm", "stars alone off truth, position, mm RMS", ""),
    ("v_off", "joint off truth, velocity, mm/s RMS", ""),
    ("v_apart", "joint minus stars, velocity, mm/s RMS", ""),
    ("heading", "joint off truth, heading, deg RMS", ""),
)
"""Numbers that the publication does not state: key, words, what is assumed."""


def draw_joint(flights: Mapping[str, Sides]) -> Drawn:
    """Figures 21 to 24."""
    sides = flights["perimeter"]
    pictures = []
    found = {}
    for side, whose, name in ((PUBLISHED, "Published methods", "joint"), (DEFAULT, "Our defaults", "filter")):
        flown = sides[side]
        rows = estimated(flown, "reintegration") if side == PUBLISHED else as_flown(flown)
        stars = estimated(flown, "stars")
        stars = np.column_stack([rows[:, 0], at(stars, rows[:, 0]).T])
        pictures.append((f"{whose}: velocity and position, stars thick.", _both(rows, stars, name)))
        apart = _apart(flown, rows, stars, name)
        pictures.append((f"{whose}: {name} minus stars, thick, and off truth.", apart))
        found[side] = _numbers(flown, rows, stars)
    ours, default = found[PUBLISHED], found[DEFAULT]
    numbers = [
        Number.beside(
            "share of time with joint minus stars within 5 cm",
            1.0,
            (ours["within"], default["within"]),
            "published is 'mostly', with a few outliers; two thirds of all time count as that",
            ratio=1.5,
        ),
        *(Number.beside(words, NAN, (ours[key], default[key]), assumed) for key, words, assumed in UNSTATED),
    ]
    words = (
        "The difference that the publication calls an error is mostly the lag of the stars: the way that a "
        f"mock-up goes within their age is {ours['lag_mm']:.0f} mm RMS. Off the truth the joint method is "
        f"{ours['off_mm']:.0f} mm, joint minus stars {ours['apart_mm']:.0f} mm."
    )
    return Drawn(pictures, numbers, words)


def _both(rows: Array, stars: Array, name: str) -> str:
    t_s = rows[:, 0]
    panels = [
        Axes(
            label,
            [
                Line("stars alone", "v1 thick", t_s, scale * stars[:, column]),
                Line(name, "v0", t_s, scale * rows[:, column]),
            ],
        )
        for column, label, scale in (
            (VX, "vX, mm/s", 1e3),
            (VY, "vY, mm/s", 1e3),
            (X, "X, m", 1.0),
            (Y, "Y, m", 1.0),
        )
    ]
    return over_time(panels, *SHOWN_S, "Velocity and position, joint and stars")


def _apart(flown: Flown, rows: Array, stars: Array, name: str) -> str:
    t_s, apart, off = rows[:, 0], rows[:, 1:].T - stars[:, 1:].T, off_truth(flown, rows)
    panels = []
    for column, label, span in (
        (X, "X apart, mm", 100.0),
        (Y, "Y apart, mm", 100.0),
        (VX, "vX apart, mm/s", 60.0),
        (VY, "vY apart, mm/s", 60.0),
    ):
        lines = [
            Line(f"{name} minus stars", "v1 thick", t_s, 1e3 * apart[column - 1]),
            Line(f"{name} minus truth", "v0", t_s, 1e3 * off[column - 1]),
        ]
        panels.append(Axes(label, lines, (-span, span)))
    return over_time(panels, *SHOWN_S, "Differences of position and velocity")


def _numbers(flown: Flown, rows: Array, stars: Array) -> dict[str, float]:
    inside = (rows[:, 0] > FROM_S) & (rows[:, 0] < SHOWN_S[1])
    rows, stars = rows[inside], stars[inside]
    off, stars_off = off_truth(flown, rows), off_truth(flown, stars)
    apart = rows[:, 1:].T - stars[:, 1:].T
    true = flown.truth(rows[:, 0] + flown.zero_s)
    distance = np.hypot(apart[0], apart[1])
    fixes = flown.data.stars
    newest = np.searchsorted(fixes[:, 1], rows[:, 0] + flown.zero_s, side="right") - 1
    age_s = rows[:, 0] + flown.zero_s - fixes[np.maximum(newest, 0), 0]
    return {
        "within": float(np.mean(distance < MOSTLY_M)),
        "apart_mm": 1e3 * rms(distance),
        "lag_mm": 1e3 * rms(np.hypot(true[3], true[4]) * age_s),
        "off_mm": 1e3 * rms(np.hypot(off[0], off[1])),
        "stars_mm": 1e3 * rms(np.hypot(stars_off[0], stars_off[1])),
        "v_off": 1e3 * rms(np.hypot(off[3], off[4])),
        "v_apart": 1e3 * rms(np.hypot(apart[3], apart[4])),
        "heading": math.degrees(rms(off[2])),
    }
