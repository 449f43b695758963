"""Centres of a relative-navigation data set: ``frame,t,marker,u,v``, a row for each centre."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.data_sets.relative_case import RelativeCase
from groundstation.files.errors import FileError
from groundstation.files.number_tables import load_table
from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.tracker_settings import Frame

COLUMNS = ("frame", "t", "marker", "u", "v")
UNLABELLED = -1
MOST_CENTRES = 200
"""In one frame: more are a picture of something else."""
MOST_FILLED = 100_000


def read_pixels(path: Path, case: RelativeCase) -> list[Frame]:
    """Return the frames in order of time; numbers left out between others are frames without centres.

    Raises:
        FileError: A column or value is missing or wrong, times do not grow, or a marker is none of the
            target.
    """
    table = load_table(path, COLUMNS, most={"u": 1e6, "v": 1e6, "t": 1e12, "frame": 1e9})
    if not len(table.numbers):
        raise FileError(f"{path}: holds no centres.")
    numbers, lines = table.numbers, table.lines
    for column in (0, 2):
        odd = np.flatnonzero(numbers[:, column] != np.round(numbers[:, column]))
        if len(odd):
            raise FileError(
                f"{path}: line {lines[odd[0]]}, column {COLUMNS[column]}: expected a whole number, found "
                f"{numbers[odd[0], column]:g}."
            )
    count = len(case.settings.target)
    if case.labelled:
        odd = np.flatnonzero((numbers[:, 2] < UNLABELLED) | (numbers[:, 2] >= count))
        if len(odd):
            raise FileError(
                f"{path}: line {lines[odd[0]]}: marker {numbers[odd[0], 2]:.0f} is none of the case's "
                f"{count} points."
            )
    order = np.argsort(numbers[:, 0], kind="stable")
    numbers, lines = numbers[order], lines[order]
    starts = np.flatnonzero(np.diff(numbers[:, 0], prepend=np.nan) != 0.0)
    frames: list[Frame] = []
    for begin, end in zip(starts, [*starts[1:], len(numbers)], strict=True):
        frames.append(_frame(path, numbers[begin:end], lines[begin:end], case))
    for one, other in itertools.pairwise(frames):
        if not other.t_s > one.t_s:
            raise FileError(
                f"{path}: frame {other.number} is at t = {other.t_s:g} s, not after frame {one.number} at "
                f"{one.t_s:g} s."
            )
    return _filled(frames)


def _frame(path: Path, rows: NDArray[np.float64], lines: NDArray[np.int64], case: RelativeCase) -> Frame:
    name = int(rows[0, 0])
    if np.ptp(rows[:, 1]) != 0.0:
        odd = int(np.flatnonzero(rows[:, 1] != rows[0, 1])[0])
        raise FileError(
            f"{path}: line {lines[odd]}: frame {name} has t = {rows[odd, 1]:g} here and "
            f"{rows[0, 1]:g} before."
        )
    if len(rows) > MOST_CENTRES:
        raise FileError(f"{path}: frame {name} has {len(rows)} centres, expected at most {MOST_CENTRES}.")
    markers = rows[:, 2].astype(np.int64)
    if case.labelled:
        known = markers[markers >= 0]
        found, times = np.unique(known, return_counts=True)
        if np.any(times > 1):
            raise FileError(f"{path}: frame {name} shows marker {found[times.argmax()]} twice.")
    variance = case.sigma_px**2
    covariances = np.broadcast_to(variance * np.eye(2), (len(rows), 2, 2))
    return Frame(
        name,
        float(rows[0, 1]),
        Centres(rows[:, 3:5].copy(), covariances, markers if case.labelled else None, case.sigma_px),
    )


def _filled(frames: list[Frame]) -> list[Frame]:
    """Frames without a centre have no row: numbers left out get times between their neighbours'."""
    if frames[-1].number - frames[0].number > MOST_FILLED:
        return frames
    filled: list[Frame] = []
    for frame in frames:
        if filled:
            before = filled[-1]
            gap = frame.number - before.number
            for step in range(1, gap):
                share = step / gap
                t_s = before.t_s + share * (frame.t_s - before.t_s)
                nothing = Centres(
                    np.empty((0, 2)),
                    np.empty((0, 2, 2)),
                    None if frame.centres.points is None else np.empty(0, np.int64),
                )
                filled.append(Frame(before.number + step, t_s, nothing))
        filled.append(frame)
    return filled
