"""The rows of a score: time, rate, accuracy, each with what must be reached and what is aimed at."""

from collections.abc import Sequence

import numpy as np

from bench.limits import at_least, at_most, between, plain
from bench.rows import Row
from bench.star.score import Score

TOTAL_MS = ((3.0, 7.0), (1.2, 3.0))
"""Must and aim of median and p99; so below."""
SOLVING_MS = ((1.5, 4.0), (0.4, 1.5))
DARK_MS = (12.0, 5.0)
IDENTIFIED = dict.fromkeys(("easy", "blur", "edge", "false-lights", "leds-out", "mixed"), (99.5, 100.0)) | {
    "sparse": (98.0, 100.0)
}
"""Per cent, must and aim."""
POSITION_MM = {"easy": (0.030, 0.022), "edge": (0.060, 0.045), "blur": (0.22, 0.15), "sparse": (0.30, 0.20)}
HEADING_DEG = {"easy": (0.0016, 0.0012), "blur": (0.014, 0.010), "sparse": (0.014, 0.010)}


def rows_of(score: Score, what: str) -> list[Row]:
    """Rows for every kind of picture that was there.

    Args:
        score: Of pictures whose kinds carry the names above; ``sparse`` has 4 to 10 stars.
        what: Begins every row.
    """
    kinds = list(dict.fromkeys([kind for kind, _ in score.errors] + score.missed))
    rows = _times(score, what)
    rows += [_identified(score, what, kind) for kind in kinds]
    rows.append(at_most(f"{what}: false fixes", score.false, 0, 0, note=f"on {len(score.total_ms)} pictures"))
    for name, found, limits, unit in (
        ("position", score.position_mm, POSITION_MM, "mm"),
        ("heading", score.heading_deg, HEADING_DEG, "deg"),
    ):
        for kind in kinds:
            row = f"{what}: {name} RMS, {kind}"
            limit, figure = limits.get(kind), found(kind)
            if limit is not None:
                rows.append(at_most(row, figure, *limit, unit))
            elif np.isfinite(figure):
                rows.append(plain(row, figure, unit))
    if score.chi2:
        chi2 = float(np.mean(score.chi2))
        rows.append(between(f"{what}: squared errors over reported covariance, by 3", chi2, 0.5, 2.0))
    return rows


def _times(score: Score, what: str) -> list[Row]:
    def both(times: Sequence[float]) -> list[float]:
        return [float(x) for x in np.percentile(times, [50, 99])]

    total, detecting, solving = map(both, (score.total_ms, score.detect_ms, score.solve_ms))
    rows = [
        at_most(f"{what}: total CPU per picture, median / p99", total, *TOTAL_MS, "ms", _units(score, total)),
        plain(f"{what}: detection alone, median / p99", detecting, "ms", _units(score, detecting)),
        at_most(
            f"{what}: identification and refinement, median / p99",
            solving,
            *SOLVING_MS,
            "ms",
            _units(score, solving),
        ),
    ]
    if score.dark_ms:
        worst = max(score.dark_ms)
        note = f"of {len(score.dark_ms)}; {_units(score, [worst])}"
        rows.append(at_most(f"{what}: picture that matches nothing, worst", worst, *DARK_MS, "ms", note))
    return rows


def _identified(score: Score, what: str, kind: str) -> Row:
    name = f"{what}: identified, {'4 to 10 stars' if kind == 'sparse' else kind}"
    count = f"of {sum(k == kind for k, _ in score.errors) + score.missed.count(kind)}"
    if kind not in IDENTIFIED:
        return plain(name, score.rate(kind), "%", count)
    return at_least(name, score.rate(kind), *IDENTIFIED[kind], "%", count)


def _units(score: Score, times_ms: Sequence[float]) -> str:
    """Times as multiples of the small unit, taken in the same run."""
    unit_ms = float(np.median(score.unit_ms))
    return f"{' / '.join(score.units(ms) for ms in times_ms)} units of {unit_ms:.3f} ms"
