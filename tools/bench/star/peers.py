"""Other methods on the same pictures in the same process: time and errors over ours, share found."""

from collections.abc import Callable, Sequence

import numpy as np

from bench.limits import plain
from bench.rows import Bench, Row
from bench.star.asterisms import Astroalign
from bench.star.laboratory import CAMERA_FILE, CEILING_FILE, TAGS, Frame, Laboratory
from bench.star.score import Score, Solver, run_beside
from bench.star.squares import KINDS, SquareCeiling
from bench.star.tetra import Tetra
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import detect
from groundstation.star_tracking.published import PublishedTracker
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

SEED = 3
PICTURES = 60
"""Of each kind at most."""
SLOW_PICTURES = 5
"""Of each kind for astroalign, which takes half a second for one, and minutes for some without a ceiling."""
SQUARE_PICTURES = 30
"""Of each kind that squares are drawn for."""
SHARP = ("easy", "edge")
FOUND = ("easy", "blur", "edge", "false-lights", "leds-out", "mixed", "sparse")
COMPARED = ("easy", "edge", "blur")
OURS, BESIDE = "ours", "beside:"


def measure(bench: Bench) -> list[Row]:
    """Four rows per method."""
    camera, catalogue = CameraCalibration.load(CAMERA_FILE), StarCatalogue.load(CEILING_FILE)
    laboratory = Laboratory(SEED)
    frames = [frame for tag in TAGS for frame in laboratory.frames(tag, min(PICTURES, bench.frames))]
    makers: dict[str, Callable[[], Solver]] = {
        OURS: lambda: StarTracker(catalogue, camera).solve,
        "published method": lambda: PublishedTracker(catalogue, camera).solve,
        "tetra3rs": lambda: Tetra(catalogue, camera, bench.folder, 50).solve,
        "tetra3rs, 20 times the patterns": lambda: (
            Tetra(
                catalogue, camera, bench.folder, 1000, match_threshold=1e-3, pattern_checking_stars=45
            ).solve
        ),
    }
    solvers, rows = _made(makers)
    _warm(frames, solvers)
    scores = run_beside(frames, solvers, bench.say)
    ours = scores.pop(OURS)
    rows[:0] = _own(ours)
    for name, score in scores.items():
        rows += _beside(name, score, ours)
    few = _first(frames, COMPARED, SLOW_PICTURES)
    slow, missing = _made({OURS: makers[OURS], "astroalign": lambda: Astroalign(catalogue, camera).solve})
    slow_scores = run_beside(few, slow, bench.say)
    if "astroalign" in slow_scores:
        rows += _beside("astroalign", slow_scores["astroalign"], slow_scores[OURS])
    rows += missing
    sharp = _first(frames, SHARP, SQUARE_PICTURES)
    mine = run_beside(sharp, {OURS: solvers[OURS]})[OURS]
    for name in KINDS:
        score = SquareCeiling(name, camera, catalogue).score(sharp, bench.say)
        rows += _beside(f"{name} squares for LEDs", score, mine)
    return rows


def _made(makers: dict[str, Callable[[], Solver]]) -> tuple[dict[str, Solver], list[Row]]:
    """The methods that are installed, and a row for each that is not."""
    solvers: dict[str, Solver] = {}
    rows = []
    for name, make in makers.items():
        try:
            solvers[name] = make()
        except ImportError as error:
            rows.append(Row(f"{BESIDE} {name}", "", f"not available: {error}", None))
    return solvers, rows


def _warm(frames: Sequence[Frame], solvers: dict[str, Solver]) -> None:
    for frame in frames[:10]:
        spots = detect(frame.image)
        for solve in solvers.values():
            solve(spots)


def _first(frames: Sequence[Frame], tags: Sequence[str], count: int) -> list[Frame]:
    """So many of each kind."""
    return [frame for tag in tags for frame in [f for f in frames if f.tag == tag][:count]]


def _own(ours: Score) -> list[Row]:
    times = np.percentile(ours.total_ms, [50, 99]).tolist()
    rates, position = [ours.rate(tag) for tag in FOUND], [ours.position_mm(tag) for tag in COMPARED]
    units = " / ".join(ours.units(ms) for ms in times)
    return [
        plain(f"{BESIDE} {OURS}: total CPU, median / p99", times, "ms", f"{units} units"),
        plain(f"{BESIDE} {OURS}: identified {' / '.join(FOUND)}", rates, "%", _false(ours)),
        plain(f"{BESIDE} {OURS}: position RMS {' / '.join(COMPARED)}", position, "mm"),
    ]


def _beside(name: str, score: Score, ours: Score) -> list[Row]:
    """Time and error as multiples of ours; kinds that the method did not see are left out."""
    seen = {tag for tag, _ in score.errors} | set(score.missed)
    found = [tag for tag in FOUND if tag in seen]
    compared = [tag for tag in COMPARED if tag in seen]
    theirs, own = (np.percentile(x.total_ms, [50, 99]) for x in (score, ours))
    position = [score.position_mm(tag) / ours.position_mm(tag) for tag in compared]
    heading = [score.heading_deg(tag) / ours.heading_deg(tag) for tag in compared]
    units = " / ".join(score.units(ms) for ms in theirs)
    rates = [score.rate(tag) for tag in found]
    what = f"{BESIDE} {name}"
    return [
        plain(f"{what}: total CPU over ours, median / p99", (theirs / own).tolist(), "x", f"{units} units"),
        plain(f"{what}: identified {' / '.join(found)}", rates, "%", _false(score)),
        plain(f"{what}: position RMS over ours, {' / '.join(compared)}", position, "x"),
        plain(f"{what}: heading RMS over ours, {' / '.join(compared)}", heading, "x"),
    ]


def _false(score: Score) -> str:
    return f"{score.false} false fixes, {len(score.total_ms)} pictures"
