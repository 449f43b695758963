"""Do the anchors, measured by tape, agree with the pictures and with each other?

A similarity lays the map of the pictures on the tape's numbers. Its scale states whether the tape speaks
in metres and of the stars that were clicked; what is left over states which anchor is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]

_SCALE_RANGE = (0.75, 1.33)  # the height is a guess, but a guess within a quarter
_OUTLIER_SIGMAS = 5.0
_LEAST_SPREAD_RATIO = 1e-3  # anchors nearer together than this fix no turn and no scale


class TapeError(ValueError):
    """The anchors cannot fix the frame of the table; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class TapeFit:
    """Similarity tape = factor * map + shift.

    Attributes:
        factor: Scale times exp(i turn).
        shift_m: Translation.
        rms_m: Root mean square distance of the anchors that is left.
    """

    factor: complex
    shift_m: complex
    rms_m: float


def fit_tape(names: Sequence[str], map_m: Complex, tape_m: Complex, tape_sigma_m: float) -> TapeFit:
    """Lay the map on the tape's numbers.

    Args:
        names: Of the anchors.
        map_m: Where the pictures put them, shape (a,), up to a similarity near scale 1.
        tape_m: By tape, shape (a,).
        tape_sigma_m: How well the tape was read, one sigma per axis.

    Raises:
        TapeError: The anchors are in one place, at an impossible scale, or contradict each other.
    """
    factor, shift = _similarity(map_m, tape_m)
    scale = abs(factor)
    if not _SCALE_RANGE[0] < scale < _SCALE_RANGE[1]:
        raise TapeError(
            f"by tape the anchors are {scale:.3g} times as far apart as in the pictures under the given "
            "ceiling height: a wrong star was clicked, a number swapped, or a unit is not metre"
        )
    left = np.abs(factor * map_m + shift - tape_m)
    # The fit takes up four of the 2a numbers; what is left is that much smaller than the tape's error.
    freedom = 2 * len(names) - 4
    rms_m = float(np.sqrt((left**2).mean()))
    if freedom > 0 and float((left**2).sum()) > freedom * (_OUTLIER_SIGMAS * tape_sigma_m) ** 2:
        raise TapeError(_accuse(names, map_m, tape_m, tape_sigma_m, rms_m))
    return TapeFit(factor, shift, rms_m)


def _accuse(names: Sequence[str], map_m: Complex, tape_m: Complex, tape_sigma_m: float, rms_m: float) -> str:
    """Say which anchor is wrong, where the others agree without it and there is one more to judge by."""
    verdicts = []
    for one in range(len(names)):
        rest = np.arange(len(names)) != one
        factor, shift = _similarity(map_m[rest], tape_m[rest])
        left = np.abs(factor * map_m[rest] + shift - tape_m[rest])
        freedom = 2 * int(rest.sum()) - 4
        agrees = float((left**2).sum()) <= freedom * (_OUTLIER_SIGMAS * tape_sigma_m) ** 2
        if freedom > 0 and agrees and _SCALE_RANGE[0] < abs(factor) < _SCALE_RANGE[1]:
            verdicts.append((one, abs(factor * map_m[one] + shift - tape_m[one])))
    contradiction = f"the anchors contradict each other by {rms_m:.3g} m (tape sigma {tape_sigma_m:.3g} m)"
    if len(verdicts) == 1:
        one, off = verdicts[0]
        return f"{contradiction}: anchor '{names[one]}' lies {off:.3g} m from where the others put it"
    return f"{contradiction}: measure and click them again"


def _similarity(source: Complex, goal: Complex) -> tuple[complex, complex]:
    centred, aim = source - source.mean(), goal - goal.mean()
    spread = float((np.abs(centred) ** 2).sum())
    if spread < _LEAST_SPREAD_RATIO**2:
        raise TapeError("the anchors are all in one place")
    factor = complex((aim * np.conj(centred)).sum() / spread)
    return factor, complex(goal.mean() - factor * source.mean())
