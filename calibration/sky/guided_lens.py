"""The lens of a star camera by the stars themselves, step by step, while it is moved over the table."""

from __future__ import annotations

from calibration.manoeuvres import tour
from calibration.outcome import Outcome
from calibration.sky.guided_mount import complaints, numbers, star_drawing
from calibration.sky.guided_pictures import CHECK, GuidedPictures, Plan, missing_camera
from calibration.sky.lens import lens_from_stars
from groundstation.declarations.guide import Goal, Step
from groundstation.declarations.rig import Rig
from groundstation.star_tracking.camera_model import CameraCalibration

STEPS: tuple[Step, ...] = (
    Step(
        "move",
        "Move the mock-up over the table and turn it, so that stars are seen all over the picture.",
        False,
        (
            Goal("pictures", 45.0, "pictures", is_amount=True),
            Goal("covered", 0.95, "of the picture", is_amount=True),
        ),
        300.0,
    ),
    Step(
        CHECK,
        "Go on elsewhere: these pictures are kept apart, and judge the result.",
        False,
        (Goal("pictures_aside", 20.0, "pictures", is_amount=True),),
        200.0,
    ),
)
PLAN = Plan(STEPS, {"move": tour, CHECK: tour})


class GuidedLens(GuidedPictures):
    """One calibration of a lens.

    Args:
        rig: Of the run.
        vehicle: Whose camera.
    """

    def __init__(self, rig: Rig, vehicle: str) -> None:
        super().__init__(rig, vehicle, PLAN)

    def outcome(self) -> Outcome:
        """Return focal lengths, principal point and distortion, tried on the pictures set aside.

        Raises:
            CalibrationRefusedError: Too few pictures could be solved, or they do not determine the lens.
        """
        found = lens_from_stars(self.fitted, self.catalogue, self.camera)
        assert isinstance(found.camera, CameraCalibration)
        after = self.judged(found.camera, self.catalogue)
        before = self.judged(self.camera, self.catalogue)
        warnings = (*found.warnings, *complaints(before, after))
        if after.rms_px > 1.1 * before.rms_px:
            warnings = (*warnings, "stars of the pictures set aside fit the rig's own lens better")
        return Outcome(
            title=f"Star camera's lens of {self.vehicle}, guided",
            summary=found.summary,
            quantities=found.quantities,
            residual=found.residual,
            notes={
                **found.notes,
                "held": "mount and height of the ceiling",
                **{f"step_{step}": outcome for step, outcome in self.steps.outcomes.items()},
            },
            draw=found.draw,
            warnings=warnings,
            camera=found.camera,
            verification=numbers(before, after),
            verified_by=f"{after.pictures} pictures of other places",
            drawings=(star_drawing(before, after),),
        )


class LensWizard:
    """Makes guided calibrations of the star camera's lens."""

    summary = "Star camera's lens: focal lengths, principal point and distortion, by the stars."

    def missing(self, rig: Rig, vehicle: str) -> str:
        """Return what the rig lacks."""
        return missing_camera(rig, vehicle)

    def begin(self, rig: Rig, vehicle: str) -> GuidedLens:
        """Begin to calibrate the camera of a vehicle."""
        return GuidedLens(rig, vehicle)


WIZARD = LensWizard()
