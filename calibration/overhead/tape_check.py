"""Why tape and pictures of a board contradict each other: what of the tape, changed, makes them agree."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from calibration.outcome import CalibrationRefusedError
from calibration.overhead.camera_pose import BoardView, OverheadPose

Fit = Callable[[Sequence[BoardView]], OverheadPose]
Change = Callable[[BoardView], BoardView]

_UNITS = {1e-3: "mm", 1e-2: "cm", 0.0254: "inches", 0.3048: "feet"}
_QUARTER = math.pi / 2.0
_MOST_PLACES = 10
"""Of more, not every pair is tried for having been swapped."""
_SIZES = (0.2, 5.0)
"""Between which a board may be larger than stated."""
_SIZE_ROUNDS = 4
_SIZE_WORDS = "with squares {:.4g} times as large as stated they agree: measure one"
DOUBTFUL_SIGMAS = 2.0
"""A tape that errs so many times as far as stated, and no longer with another size of the board, is right."""


def once(views: Sequence[BoardView]) -> tuple[list[BoardView], list[str]]:
    """Return every picture once, and the names of those that came again.

    Raises:
        CalibrationRefusedError: A picture came again with another place.
    """
    kept: list[BoardView] = []
    again = []
    for view in views:
        first = next((old for old in kept if np.array_equal(old.pixel, view.pixel)), None)
        if first is None:
            kept.append(view)
        elif first.tape == view.tape:
            again.append(view.name)
        else:
            raise CalibrationRefusedError(
                f"pictures '{first.name}' and '{view.name}' are one and the same, but have two places"
            )
    return kept, again


def agreeing(views: Sequence[BoardView], fit: Fit) -> OverheadPose:
    """Return the camera of views whose tape agrees with the pictures.

    Args:
        views: As given.
        fit: Finds the camera.

    Raises:
        CalibrationRefusedError: Tape and pictures contradict each other; the likely cause is named.
    """
    try:
        found = fit(views)
    except CalibrationRefusedError as error:
        cause = _cause(views, fit)
        if not cause:
            raise
        raise CalibrationRefusedError(f"tape and pictures contradict each other: {cause}") from error
    if found.is_credible:
        size = _size(views, fit) if found.tape_sigmas > DOUBTFUL_SIGMAS else None
        if size is None or size[1].tape_sigmas > found.tape_sigmas / DOUBTFUL_SIGMAS:
            return found
        cause = _SIZE_WORDS.format(size[0])
    else:
        cause = _cause(views, fit)
    off = f"{found.tape_sigmas:.3g} times as far as the tape is stated to err"
    off = f"places would have to move by up to {1e3 * float(np.abs(found.tape_m).max()):.3g} mm, {off}"
    if found.tape_sigmas <= DOUBTFUL_SIGMAS:
        off = f"corners are left {found.corner_rms_px:.3g} px from where they should be"
        cause = cause or "another lens, another board, or one that is bent"
    cause = cause or "measure the places again"
    raise CalibrationRefusedError(f"tape and pictures contradict each other: {cause} ({off})")


def _cause(views: Sequence[BoardView], fit: Fit) -> str:
    agree = (words for words, changed in _guesses(views) if _agrees(changed, fit))
    causes = list(itertools.islice(agree, 1))
    if not causes and len({view.tape for view in views}) > 2:
        causes = [
            f"the place of '{view.name}' is wrong, the others agree"
            for k, view in enumerate(views)
            if _agrees([*views[:k], *views[k + 1 :]], fit)
        ]
    if causes:
        return causes[0]
    size = _size(views, fit)
    return "" if size is None else _SIZE_WORDS.format(size[0])


def _agrees(views: Sequence[BoardView], fit: Fit) -> bool:
    try:
        return fit(views).is_credible
    except CalibrationRefusedError:
        return False


def _guesses(views: Sequence[BoardView]) -> Iterator[tuple[str, list[BoardView]]]:
    """Yield what may have gone wrong, and the views without it."""
    for words, change in _changes():
        yield words, [change(view) for view in views]
    first = {view.tape: view for view in reversed(views)}
    if len(first) < len(views):
        yield "pictures with one place in places.csv show the board in several", list(first.values())
    if len(views) > _MOST_PLACES:
        return
    for a, b in itertools.combinations(range(len(views)), 2):
        if views[a].tape == views[b].tape:
            continue
        swapped = list(views)
        swapped[a], swapped[b] = _at(views[a], *views[b].tape), _at(views[b], *views[a].tape)
        yield f"the places of '{views[a].name}' and '{views[b].name}' are swapped", swapped
    for k, view in enumerate(views):
        turned = [*views[:k], _at(view, view.y_m, view.x_m, view.heading_rad), *views[k + 1 :]]
        yield f"x and y of '{view.name}' are swapped", turned


def _changes() -> Iterator[tuple[str, Change]]:
    for size, unit in _UNITS.items():
        yield f"the places seem to be in {unit}, metres are expected", _scaled(size)
    yield "x and y are swapped", lambda v: _at(v, v.y_m, v.x_m, v.heading_rad)
    yield "x has the wrong sign", lambda v: _at(v, -v.x_m, v.y_m, v.heading_rad)
    yield "y has the wrong sign", lambda v: _at(v, v.x_m, -v.y_m, v.heading_rad)
    yield "the headings have the wrong sign", lambda v: _at(v, v.x_m, v.y_m, -v.heading_rad)
    yield "the table is mirrored", lambda v: _at(v, v.x_m, -v.y_m, -v.heading_rad)
    yield (
        "the headings seem to be in radians, degrees are expected",
        lambda v: _at(v, v.x_m, v.y_m, math.degrees(v.heading_rad)),
    )
    for turn_rad, words in (
        (_QUARTER, "of the short edge, the long one's are expected"),
        (-_QUARTER, "of the short edge, the long one's are expected"),
        (math.pi, "half a turn off: the long edge points away from the corner that is measured"),
    ):
        yield f"the headings are {words}", _turned(turn_rad)


def _at(view: BoardView, x_m: float, y_m: float, heading_rad: float) -> BoardView:
    return replace(view, x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def _scaled(size: float) -> Change:
    return lambda v: _at(v, size * v.x_m, size * v.y_m, v.heading_rad)


def _turned(turn_rad: float) -> Change:
    return lambda v: _at(v, v.x_m, v.y_m, v.heading_rad + turn_rad)


def _size(views: Sequence[BoardView], fit: Fit) -> tuple[float, OverheadPose] | None:
    """Return how much larger than stated the board would have to be, and the camera then; None: not that."""
    size, low, high = 1.0, *_SIZES
    for _ in range(_SIZE_ROUNDS):
        ratio = _ratio(views, size, fit)
        if ratio is None or not low < size * ratio < high:
            return None
        size *= ratio
    try:
        found = fit(_resized(views, size))
    except CalibrationRefusedError:
        return None
    return (size, found) if found.is_credible else None


def _resized(views: Sequence[BoardView], size: float) -> list[BoardView]:
    return [replace(view, board_m=size * view.board_m) for view in views]


def _ratio(views: Sequence[BoardView], size: float, fit: Fit) -> float | None:
    """Return distances by tape over those by a board of this size."""
    try:
        found = fit(_resized(views, size))
    except CalibrationRefusedError:
        return None
    tape_m = np.array(list(dict.fromkeys(view.tape for view in views)))[:, :2]
    seen_m = tape_m + found.tape_m
    spread = np.square(seen_m - seen_m.mean(axis=0)).sum()
    together = ((seen_m - seen_m.mean(axis=0)) * (tape_m - tape_m.mean(axis=0))).sum()
    return float(together / spread) if spread > 0.0 else None
