"""Pictures of one mock-up from another one's side camera, drawn by the emulator, with what they show."""

import math
from pathlib import Path

import numpy as np

from firmware_emulator.side_view.scene import read_hulls, read_side_camera
from firmware_emulator.side_view.side_view import SideView, SunLamp
from groundstation.relative_navigation.side_bodies import load_side_bodies
from groundstation.relative_navigation.side_camera import SideCamera
from groundstation.relative_navigation.sighting import Seen

FILES = Path(__file__).parents[4] / "calibration" / "rigs" / "emulated"
CAMERA = SideCamera.load(FILES / "side_camera.json")
BODIES = {body.vehicle: body for body in load_side_bodies(FILES / "side_bodies.toml")}
HERE = (0.0, 0.0, 0.0)


class Scene:
    """One side camera on a mock-up at the origin of the table.

    Args:
        lamp_deg: Direction towards the sun lamp, from the camera's axis, to the left.
        level_dn: Its brightness.
        ambient: Share of it from everywhere.
    """

    def __init__(self, lamp_deg=120.0, level_dn=200.0, ambient=0.0):
        lamp = SunLamp(math.radians(lamp_deg), 0.25, level_dn, ambient)
        optics, hulls = read_side_camera(FILES / "side_camera.json"), read_hulls(FILES / "side_bodies.toml")
        self._view = SideView(optics, hulls, lamp, np.random.SeedSequence(4))
        self._count = 0

    def picture(self, **poses):
        """The next picture with mock-ups at poses of the own body frame."""
        self._count += 1
        paths = {name: (pose, pose) for name, pose in poses.items()}
        return self._view.render((HERE, HERE), paths, self._count)


def pose_at(range_m, bearing_rad, heading_rad):
    return range_m * math.cos(bearing_rad), range_m * math.sin(bearing_rad), heading_rad


class Errors:
    """Sightings against what was drawn."""

    def __init__(self):
        self.range_m, self.bearing_rad, self.heading_rad, self.nes = [], [], [], []
        self.unseen = []

    def add(self, answer, pose):
        if not isinstance(answer, Seen):
            self.unseen.append(answer.reason)
            return
        self.range_m.append(answer.range_m - math.hypot(*pose[:2]))
        bearing_rad = answer.bearing_rad - math.atan2(pose[1], pose[0])
        self.bearing_rad.append(math.remainder(bearing_rad, math.tau))
        off = np.array(
            [*(answer.position_body_m - pose[:2]), math.remainder(answer.heading_rad - pose[2], math.tau)]
        )
        count = 3 if math.isfinite(answer.covariance[2, 2]) else 2
        self.heading_rad.append(off[2])
        covariance = answer.covariance[:count, :count]
        self.nes.append(float(off[:count] @ np.linalg.solve(covariance, off[:count])) / count)

    def rms(self, name):
        return float(np.sqrt(np.mean(np.square(getattr(self, name)))))
