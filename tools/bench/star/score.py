"""Errors, rates and times of one method over pictures with truth."""

import gc
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bench.limits import short
from bench.star.laboratory import Frame
from bench.unit import blur_s
from groundstation.star_tracking.detection import Detector, Spots
from groundstation.star_tracking.fixes import NoFix, PictureFix

GATE_M, GATE_RAD = 0.02, np.radians(1.0)
"""A fix outside, or any fix on a picture without the ceiling, is false (as the data sets' scorer says)."""
Answer = tuple[float, float, float]
"""x m, y m, heading rad."""


@dataclass(slots=True)
class Score:
    """What came out, in the order of the pictures.

    Attributes:
        unit_ms: CPU time of the unit (``cv2.GaussianBlur`` 5x5 on the picture), taken before each picture.
        detect_ms: CPU time from the picture to its spots.
        solve_ms: CPU time from spots to fix.
        dark_ms: CPU time of both, on pictures that show no ceiling.
        errors: Kind of picture and (x, y, heading) error of every identified one.
        missed: Kind of every picture that was not identified.
        false: Fixes that are wrong.
        chi2: Errors squared over their reported covariance, by three.
    """

    unit_ms: list[float] = field(default_factory=list)
    detect_ms: list[float] = field(default_factory=list)
    solve_ms: list[float] = field(default_factory=list)
    dark_ms: list[float] = field(default_factory=list)
    errors: list[tuple[str, NDArray[np.float64]]] = field(default_factory=list)
    missed: list[str] = field(default_factory=list)
    false: int = 0
    chi2: list[float] = field(default_factory=list)

    @property
    def total_ms(self) -> NDArray[np.float64]:
        """From picture to fix, as ``star-tracker solve`` writes it."""
        return np.add(self.detect_ms, self.solve_ms)

    def units(self, ms: float) -> str:
        """A time as a multiple of the unit."""
        return short(ms / float(np.median(self.unit_ms)))

    def position_mm(self, *kinds: str) -> float:
        """RMS distance of the identified pictures of these kinds; NaN without any."""
        found = self._of(kinds)
        return 1e3 * float(np.sqrt((found[:, :2] ** 2).sum(axis=1).mean())) if len(found) else float("nan")

    def heading_deg(self, *kinds: str) -> float:
        """RMS heading error; NaN without any."""
        found = self._of(kinds)
        return float(np.degrees(np.sqrt((found[:, 2] ** 2).mean()))) if len(found) else float("nan")

    def rate(self, *kinds: str) -> float:
        """Percentage that was identified; NaN without any."""
        found, missed = len(self._of(kinds)), sum(kind in kinds for kind in self.missed)
        return 100.0 * found / (found + missed) if found + missed else float("nan")

    def _of(self, kinds: Sequence[str]) -> NDArray[np.float64]:
        return np.array([error for kind, error in self.errors if kind in kinds]).reshape(-1, 3)

    def take(
        self,
        frame: Frame,
        answer: PictureFix | NoFix | Answer | None,
        unit_ms: float,
        detect_ms: float,
        solve_ms: float,
    ) -> None:
        """Count one answer with its times."""
        self.unit_ms.append(unit_ms)
        self.detect_ms.append(detect_ms)
        self.solve_ms.append(solve_ms)
        if frame.pose is None:
            self.dark_ms.append(detect_ms + solve_ms)
        if isinstance(answer, PictureFix):
            self._judge(frame, (answer.x_m, answer.y_m, answer.heading_rad), answer.covariance)
        else:
            self._judge(frame, None if isinstance(answer, NoFix) else answer, None)

    def _judge(self, frame: Frame, answer: Answer | None, covariance: NDArray[np.float64] | None) -> None:
        if frame.pose is None:
            self.false += answer is not None
            return
        if answer is not None:
            error = np.subtract(answer, frame.pose)
            error[2] = np.angle(np.exp(1j * error[2]))
            if np.hypot(error[0], error[1]) <= GATE_M and abs(error[2]) <= GATE_RAD:
                self.errors.append((frame.tag, error))
                if covariance is not None:
                    self.chi2.append(float(error @ np.linalg.solve(covariance, error)) / 3.0)
                return
            self.false += 1
        self.missed.append(frame.tag)


Solver = Callable[[Spots], PictureFix | NoFix | Answer | None]
"""Spots to pose: ours with its record, others with a bare pose or None."""


def run(
    frames: Sequence[Frame],
    solve: Solver,
    say: Callable[[str], None] | None = None,
) -> Score:
    """Detect and solve every picture, each on its own."""
    return run_beside(frames, {"": solve}, say)[""]


def run_beside(
    frames: Sequence[Frame],
    solvers: Mapping[str, Solver],
    say: Callable[[str], None] | None = None,
) -> dict[str, Score]:
    """Let several methods solve every picture, one after the other, so that all see the same machine.

    The collector of garbage is kept from the modules that are loaded, as in ``star-tracker solve``.

    Args:
        frames: Pictures with truth.
        solvers: Name to method.
        say: Takes progress.
    """
    scores = {name: Score() for name in solvers}
    find = Detector().find
    find(frames[0].image)  # the first call pays for memory
    gc.freeze()
    for number, frame in enumerate(frames):
        unit = 1e3 * blur_s(frame.image)
        begin = time.process_time()
        spots = find(frame.image)
        detecting = 1e3 * (time.process_time() - begin)
        for name, solve in solvers.items():
            begin = time.process_time()
            answer = solve(spots)
            scores[name].take(frame, answer, unit, detecting, 1e3 * (time.process_time() - begin))
        if say is not None and number % 20 == 0:
            say(f"star: {number} of {len(frames)} pictures")
    gc.unfreeze()
    return scores
