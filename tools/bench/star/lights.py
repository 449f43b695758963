"""Pictures of lights that are no ceiling: how many are taken for one."""

import numpy as np

from bench.limits import at_most
from bench.rows import Bench, Row
from bench.star.laboratory import CAMERA_FILE, CEILING_FILE, spots_at
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

COUNTS = (3, 4, 5, 6, 8, 12, 20, 40)
SEED = 5
RULE_OF_THREE = 3.0
"""Without one event in n trials the rate is below 3 / n, with 95 % confidence."""


def measure(bench: Bench) -> list[Row]:
    """False fixes among ``trials`` pictures of each count."""
    camera = CameraCalibration.load(CAMERA_FILE)
    tracker = StarTracker(StarCatalogue.load(CEILING_FILE), camera)
    rng = np.random.default_rng(SEED)
    corner = (camera.width - 4, camera.height - 4)
    false = tried = 0
    for lights in COUNTS:
        for _ in range(bench.trials):
            spots = spots_at(rng.uniform((3, 3), corner, (lights, 2)))
            false += isinstance(tracker.solve(spots), PictureFix)
            tried += 1
            if tried % 100 == 0:
                bench.say(f"star: random lights, {tried} of {bench.trials * len(COUNTS)}")
    note = f"of {tried:,} pictures of {COUNTS[0]} to {COUNTS[-1]} random lights"
    if false == 0:
        note += f": rate below {RULE_OF_THREE / tried:.1g} with 95 % confidence"
    return [at_most("star: false fixes on random lights", false, 0, 0, note=note)]
