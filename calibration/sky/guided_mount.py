"""The mount of a star camera by turning in place, step by step.

A mock-up that turns about a pin, or on its air about its centre, keeps its origin where it is; a mount that
is not where the rig has it makes the origin go round in a circle. It has to be turned by hand: a vehicle that
flies by this very camera holds the place that the wrong mount shows, and would see no circle.
"""

from __future__ import annotations

import math

import numpy as np

from calibration.outcome import Outcome
from calibration.result import Quantity
from calibration.sky.guided_pictures import CHECK, GuidedPictures, Judged, Plan, missing_camera
from calibration.sky.lens import mount_from_turn
from groundstation.declarations.guide import Curve, Drawing, Goal, Mark, Step
from groundstation.declarations.rig import Rig
from groundstation.star_tracking.camera_model import CameraCalibration

WOBBLE_M = 1e-3
"""A pin, or the air, lets the centre move so far."""
MOST_WANDER_M = 3e-3
"""Beyond, it was not turned in place, and the offset is none."""
STEPS: tuple[Step, ...] = (
    Step(
        "turn",
        "With the float air on, turn the mock-up by hand slowly about its centre (on a pin, or at rest on "
        "its air), more than once around.",
        False,
        (
            Goal("pictures", 40.0, "pictures", is_amount=True),
            Goal("turned_rad", 6.5, "rad", is_amount=True),
        ),
        300.0,
        is_by_hand=True,
    ),
    Step(
        CHECK,
        "Turn on, another half turn: these pictures are kept apart, and judge the result.",
        False,
        (
            Goal("pictures_aside", 20.0, "pictures", is_amount=True),
            Goal("turned_rad", 3.3, "rad", is_amount=True),
        ),
        200.0,
        is_by_hand=True,
    ),
)
PLAN = Plan(STEPS, {})


class GuidedMount(GuidedPictures):
    """One calibration of a mount.

    Args:
        rig: Of the run.
        vehicle: Whose camera.
    """

    def __init__(self, rig: Rig, vehicle: str) -> None:
        super().__init__(rig, vehicle, PLAN)

    def outcome(self) -> Outcome:
        """Return offset, tilt and height, tried on the pictures set aside.

        Raises:
            CalibrationRefusedError: Too few pictures could be solved, or the turn is too small.
        """
        found = mount_from_turn(self.fitted, self.catalogue, self.camera, wobble_m=WOBBLE_M)
        assert isinstance(found.camera, CameraCalibration)
        after = self.judged(found.camera, self.catalogue)
        before = self.judged(self.camera, self.catalogue)
        warnings = (*found.warnings, *complaints(before, after))
        if after.wander_m > MOST_WANDER_M:
            warnings = (
                *warnings,
                f"the origin moved by {1e3 * after.wander_m:.1f} mm while it was turned: that was not in "
                "place, and the offset is not to be believed",
            )
        if after.wander_m > 1.2 * before.wander_m:
            warnings = (*warnings, "the origin wanders farther than with the rig's own mount")
        return Outcome(
            title=f"Star camera's mount of {self.vehicle}, guided",
            summary=found.summary,
            quantities=found.quantities,
            residual=found.residual,
            notes={
                **found.notes,
                "held": "lens and yaw of the mount: the yaw needs a picture whose heading is known",
                **{f"step_{step}": outcome for step, outcome in self.steps.outcomes.items()},
            },
            draw=found.draw,
            warnings=warnings,
            camera=found.camera,
            verification=numbers(before, after)
            | {
                "origin_wander": Quantity(after.wander_m, math.nan, "m"),
                "origin_wander_as_the_rig_has_it": Quantity(before.wander_m, math.nan, "m"),
            },
            verified_by=f"{after.pictures} pictures of another turn",
            drawings=(_circle(before, after), star_drawing(before, after)),
        )


def numbers(before: Judged, after: Judged) -> dict[str, Quantity]:
    """What pictures set aside tell of a camera."""
    return {
        "star_residual": Quantity(after.rms_px, math.nan, "px"),
        "star_residual_as_the_rig_has_it": Quantity(before.rms_px, math.nan, "px"),
        "pictures_solved": Quantity(float(len(after.poses)), math.nan, "1"),
        "pictures_solved_as_the_rig_has_it": Quantity(float(len(before.poses)), math.nan, "1"),
    }


def complaints(before: Judged, after: Judged) -> tuple[str, ...]:
    """Why the result may be wrong, by pictures set aside."""
    if not after.pictures:
        return ("it is not verified: no picture was set aside",)
    if len(after.poses) < len(before.poses):
        return (
            f"{len(after.poses)} pictures set aside are solved, {len(before.poses)} with the rig's camera",
        )
    return ()


def star_drawing(before: Judged, after: Judged) -> Drawing:
    """Spot less star of the pictures set aside."""
    rows: tuple[tuple[str, Judged, Mark], ...] = (
        ("with the rig's camera", before, "refused"),
        ("with the result", after, "dots"),
    )
    curves = []
    for name, each, mark in rows:
        some = each.residual_px[:: max(1, len(each.residual_px) // 400)]
        curves.append(Curve(name, some[:, 0].tolist(), some[:, 1].tolist(), mark))
    return Drawing("Pictures set aside: spot less star", "px along x", "px along y", curves, is_to_scale=True)


def _circle(before: Judged, after: Judged) -> Drawing:
    rows: tuple[tuple[str, Judged, Mark], ...] = (
        ("with the rig's mount", before, "refused"),
        ("with the result", after, "dots"),
    )
    curves = []
    for name, each, mark in rows:
        off = (
            1e3 * (each.poses[:, :2] - np.mean(each.poses[:, :2], axis=0)) if len(each.poses) else each.poses
        )
        curves.append(Curve(name, off[:, 0].tolist(), off[:, 1].tolist(), mark))
    return Drawing(
        "Pictures set aside: where the origin seems to be", "x, mm", "y, mm", curves, is_to_scale=True
    )


class MountWizard:
    """Makes guided calibrations of the star camera's mount."""

    summary = "Star camera's mount: offset and tilt on the body, by turning in place by hand."

    def missing(self, rig: Rig, vehicle: str) -> str:
        """Return what the rig lacks."""
        return missing_camera(rig, vehicle)

    def begin(self, rig: Rig, vehicle: str) -> GuidedMount:
        """Begin to calibrate the camera of a vehicle."""
        return GuidedMount(rig, vehicle)


WIZARD = MountWizard()
