"""Find out where a mock-up is from one picture of the ceiling, knowing nothing before.

    python examples/solve_a_picture.py --pose 0.3 -0.2 120

The emulator draws the picture (it shares no mathematics with the solver), the star tracker finds spots, names
the stars and gives the pose with its covariance. With ``--picture frame.png`` it solves yours.
"""

import argparse
import math
from pathlib import Path

import cv2
import numpy as np

from firmware_emulator.sky.scene import build_sky, read_camera, read_ceiling
from firmware_emulator.sky.sensor import SensorSettings
from firmware_emulator.sky.sky_camera import Shutter, SkyCamera
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import detect
from groundstation.star_tracking.fixes import NoFix
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

CALIBRATION = Path(__file__).parent.parent / "calibration" / "rigs" / "emulated"


def draw(pose: tuple[float, float, float], camera: Path, ceiling: Path) -> np.ndarray:
    """The picture at a pose (m, m, rad), uint8 (height, width)."""
    sky = build_sky(read_ceiling(ceiling), np.random.SeedSequence(1))
    seed = np.random.SeedSequence(2)
    lens = SkyCamera(read_camera(camera), sky, Shutter(exposure_s=0.01), SensorSettings(), seed)
    return lens.render(pose, pose, sequence=0)


def main() -> None:
    """Print the pose, or why there is none."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--picture", type=Path, help="grey picture; without it the emulator draws one")
    parser.add_argument("--pose", type=float, nargs=3, default=(0.3, -0.2, 120.0), metavar=("X", "Y", "DEG"))
    parser.add_argument("--camera", type=Path, default=CALIBRATION / "camera.json")
    parser.add_argument("--ceiling", type=Path, default=CALIBRATION / "ceiling.csv")
    arguments = parser.parse_args()

    x, y, heading_deg = arguments.pose
    if arguments.picture is None:
        image = draw((x, y, math.radians(heading_deg)), arguments.camera, arguments.ceiling)
    else:
        found = cv2.imread(str(arguments.picture), cv2.IMREAD_GRAYSCALE)
        if found is None:
            parser.error(f"{arguments.picture} is no picture")
        image = found.astype(np.uint8)

    tracker = StarTracker(StarCatalogue.load(arguments.ceiling), CameraCalibration.load(arguments.camera))
    answer = tracker.solve(detect(image))
    if isinstance(answer, NoFix):
        print(f"no fix: {answer.reason.value}. {answer.detail}")
        return
    print(
        f"x {answer.x_m:.5f} m, y {answer.y_m:.5f} m, heading {math.degrees(answer.heading_rad):.4f} deg, by "
        f"{answer.stars} stars; sigma {answer.sigma_x_m * 1e3:.3f} mm, {answer.sigma_y_m * 1e3:.3f} mm, "
        f"{math.degrees(answer.sigma_heading_rad):.4f} deg"
    )
    if arguments.picture is None:
        print(f"off the truth by {math.dist((answer.x_m, answer.y_m), (x, y)) * 1e3:.3f} mm")


if __name__ == "__main__":
    main()
