"""Pictures of the ceiling collected step by step for a calibration of the star camera; some are set aside."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.guided_steps import GuidedSteps, Manoeuvre
from calibration.live_curve import LiveCurve
from calibration.manoeuvres import Pose
from calibration.stepped_guide import SteppedGuide
from groundstation.declarations.guide import Curve, Drawing, Step
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.frames import wrap_angle
from groundstation.parts.stars.messages import StarFix, StarSpots
from groundstation.parts.stars.sections import StarCameraSection, StarsOfType, StarsOfVehicle
from groundstation.parts.stars.star_answers import spots_of
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

Array = NDArray[np.float64]

CHECK = "check"
LEAST_SPOTS = 5
NEW_M, NEW_RAD, NEW_NS = 0.04, math.radians(6.0), 1_500_000_000
"""A picture is kept when the mock-up has moved or turned so far since the last; unsolved ones at times."""
CELLS = (6, 4)
"""Of the picture, columns and rows: a lens is known where stars were seen."""
MOST_DRAWN = 1500


@dataclass(frozen=True, slots=True)
class Plan:
    """What a wizard collects.

    Attributes:
        steps: The table; the last step is the one set aside.
        manoeuvres: Of the steps that are flown.
        every_s: From one goal to the next.
    """

    steps: tuple[Step, ...]
    manoeuvres: Mapping[str, Manoeuvre]
    every_s: float = 7.0


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """How pictures fit a camera and a star list that they had no part in.

    Attributes:
        pictures: How many there were.
        poses: (k, 3) of those that were solved.
        residual_px: (m, 2) spot less star, in px at the middle of the picture.
    """

    pictures: int
    poses: Array
    residual_px: Array

    @property
    def rms_px(self) -> float:
        """Per axis; NaN where nothing was solved."""
        return float(np.sqrt((self.residual_px**2).mean())) if len(self.residual_px) else math.nan

    @property
    def wander_m(self) -> float:
        """How far the poses scatter about their mean, per axis; NaN where nothing was solved."""
        return float(np.sqrt(self.poses[:, :2].var(axis=0).mean())) if len(self.poses) else math.nan


class GuidedPictures(SteppedGuide):
    """Collects the spots of pictures that show something new.

    Args:
        rig: Of the run.
        vehicle: Whose camera.
        plan: What is collected.
    """

    kinds: tuple[type[Message], ...] = (StarSpots, StarFix, *GuidedSteps.kinds)

    def __init__(self, rig: Rig, vehicle: str, plan: Plan) -> None:
        super().__init__(GuidedSteps(vehicle, rig.table.keep_in(), plan.steps, plan.manoeuvres, plan.every_s))
        self.vehicle = vehicle
        section = camera_section(rig, vehicle)
        assert section is not None
        self.camera = section.camera.value(CameraCalibration.parse)
        self.catalogue = section.ceiling.value(StarCatalogue.parse)
        self.fitted: list[Spots] = []
        self.checked: list[Spots] = []
        self._newest: StarSpots | None = None
        self._kept: tuple[Pose | None, int] = (None, 0)
        self._seen = np.zeros(CELLS)
        self._drawn: list[tuple[float, float]] = []
        self._places = LiveCurve("where pictures were taken")
        self.places_m: list[tuple[float, float]] = []

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message of the vehicle."""
        del now_ns
        if message.vehicle != self.vehicle:
            return
        self.steps.take(message)
        match message:
            case StarSpots(reason="", flooded=False) if len(message.u_px) >= LEAST_SPOTS:
                self._newest = message
            case StarFix() if self._newest is not None:
                pose = (message.x_m, message.y_m, message.heading_rad) if message.fix else None
                self._keep(self._newest, pose, message.stamp_ns)
                self._newest = None

    def known(self) -> dict[str, float]:
        """The quantities of the goals."""
        return {
            "pictures": float(len(self.fitted)),
            "pictures_aside": float(len(self.checked)),
            "covered": float((self._seen >= 3).mean()),
        }

    def pictures(self) -> Sequence[Drawing]:
        """Return where in the picture stars were seen, and from where."""
        stride = max(1, len(self._drawn) // MOST_DRAWN)
        u_px, v_px = zip(*self._drawn[::stride], strict=True) if self._drawn else ((), ())
        spots = Curve("stars of all pictures", u_px, v_px)
        newest: Curve = Curve("newest picture", (), (), "crosses")
        last = self.checked or self.fitted
        if last:
            newest = Curve("newest picture", last[-1].u_px.tolist(), last[-1].v_px.tolist(), "crosses")
        title = f"Stars in {len(self.fitted)} pictures, and {len(self.checked)} set aside"
        return (
            Drawing(title, "column, px", "row, px", (spots, newest), is_to_scale=True, is_downwards=True),
            Drawing("Where from", "x, m", "y, m", (self._places.curve(),), is_to_scale=True),
        )

    def judged(self, camera: CameraCalibration, catalogue: StarCatalogue) -> Judged:
        """How the pictures set aside fit."""
        tracker = StarTracker(catalogue, camera)
        answers = (tracker.solve(spots) for spots in self.checked)
        fixes = [answer for answer in answers if isinstance(answer, PictureFix)]
        scale = camera.fx / camera.ceiling_height_above_camera_m
        poses = np.array([[fix.x_m, fix.y_m, fix.heading_rad] for fix in fixes]).reshape(-1, 3)
        residual_m = np.concatenate([fix.residual_m for fix in fixes]) if fixes else np.zeros((0, 2))
        return Judged(len(self.checked), poses, scale * residual_m)

    def _keep(self, message: StarSpots, pose: Pose | None, stamp_ns: int) -> None:
        before, before_ns = self._kept
        if pose is None or before is None:
            is_new = stamp_ns - before_ns >= NEW_NS
        else:
            is_far = math.dist(pose[:2], before[:2]) >= NEW_M
            is_new = is_far or abs(wrap_angle(pose[2] - before[2])) >= NEW_RAD
        if not is_new:
            return
        self._kept = (pose, stamp_ns)
        spots = spots_of(message)
        (self.checked if self.steps.name == CHECK else self.fitted).append(spots)
        self._drawn += zip(spots.u_px.tolist(), spots.v_px.tolist(), strict=True)
        if pose is not None:
            self._places.add(pose[0], pose[1])
            self.places_m.append((pose[0], pose[1]))
        columns, rows = CELLS
        u = np.clip((spots.u_px / self.camera.width * columns).astype(int), 0, columns - 1)
        v = np.clip((spots.v_px / self.camera.height * rows).astype(int), 0, rows - 1)
        np.add.at(self._seen, (u, v), 1)


def camera_section(rig: Rig, vehicle: str) -> StarCameraSection | None:
    """What the rig states of a vehicle's star camera; None where it has none."""
    if rig.vehicle(vehicle, StarsOfVehicle).star_camera is None:
        return None
    return rig.of_type(vehicle, StarsOfType).star_camera


def missing_camera(rig: Rig, vehicle: str) -> str:
    """What the rig lacks for a calibration by stars; empty if nothing."""
    return "" if camera_section(rig, vehicle) is not None else "it has no star camera"
