"""Pictures of four stars, and of five to ten: how many are identified."""

from bench.limits import at_least, at_most
from bench.rows import Bench, Row
from bench.star.laboratory import CAMERA_FILE, CEILING_FILE, Laboratory
from bench.star.score import run
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

SEED = 3
STARS = {"four stars": ((4, 4), (97.0, 100.0)), "five to ten stars": ((5, 10), (99.5, 100.0))}
"""Fewest and most; must and aim in per cent."""


def measure(bench: Bench) -> list[Row]:
    """Lost in space, every picture on its own, twice as many as of other kinds."""
    tracker = StarTracker(StarCatalogue.load(CEILING_FILE), CameraCalibration.load(CAMERA_FILE))
    laboratory, rows, false = Laboratory(SEED), [], 0
    count = 2 * bench.frames
    for what, (stars, limits) in STARS.items():
        score = run(list(laboratory.frames("sparse", count, stars)), tracker.solve, bench.say)
        rows.append(at_least(f"star: identified, {what}", score.rate("sparse"), *limits, "%", f"of {count}"))
        false += score.false
    return [*rows, at_most("star: false fixes on few stars", false, 0, 0, note=f"on {2 * count} pictures")]
