"""The star list of a ceiling made anew, step by step, while the mock-up is led over the whole table.

A few far stars of the list that the rig has stand for what a tape would measure: they hold the frame of the
table, and all other places are found by the pictures. A ceiling without any list is surveyed from pictures
and a tape: ``groundstation calibrate survey``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np

from calibration.manoeuvres import Pose
from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Quantity
from calibration.sky.guided_mount import complaints, numbers, star_drawing
from calibration.sky.guided_pictures import CHECK, GuidedPictures, Plan, missing_camera
from calibration.sky.survey.surveyed_sky import Anchor
from calibration.sky.survey.sweep import Survey, survey_sweep
from groundstation.declarations.guide import Curve, Drawing, Goal, Step
from groundstation.declarations.rig import Rig
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

LANE_M, STRIDE_M, MARGIN_M = 0.6, 0.5, 0.35
"""Lanes of the sweep, places along them, and what is left to the edges."""
ANCHORS, LEAST_ANCHORS, ANCHOR_SIGHTINGS = 24, 4, 4
REACH_M = 0.6
"""A place of the table counts as swept when a picture was taken so near."""
ANCHOR_SIGMA_M = 1e-3
"""How well a star of the old list is believed where the list states nothing."""
STEPS: tuple[Step, ...] = (
    Step(
        "sweep",
        "Lead the mock-up slowly in lanes over the whole table: each picture overlaps the one before.",
        False,
        (
            Goal("pictures", 40.0, "pictures", is_amount=True),
            Goal("table", 0.9, "of the table", is_amount=True),
        ),
        900.0,
    ),
    Step(
        CHECK,
        "Lead it across once more, where it has been: these pictures are kept apart, and judge the result.",
        False,
        (
            Goal("pictures_aside", 20.0, "pictures", is_amount=True),
            Goal("travelled_m", 1.0, "m", is_amount=True),
        ),
        200.0,
    ),
)


def lanes(rig: Rig) -> Callable[[int, Pose], Pose]:
    """Goals to and fro over the table, whatever it begins from."""
    table = rig.table
    x_m = _places(table.x_min_m, table.x_max_m, STRIDE_M)
    y_m = _places(table.y_min_m, table.y_max_m, LANE_M)
    goals = [(x, y) for lane, y in enumerate(y_m) for x in (x_m if lane % 2 == 0 else x_m[::-1])]

    def goal(number: int, home: Pose) -> Pose:
        del home
        x, y = goals[number % len(goals)]
        return x, y, math.pi / 6.0 * (number % 5)

    return goal


class GuidedSurvey(GuidedPictures):
    """One survey.

    Args:
        rig: Of the run.
        vehicle: Whose camera.
    """

    def __init__(self, rig: Rig, vehicle: str) -> None:
        sweep = lanes(rig)
        super().__init__(rig, vehicle, Plan(STEPS, {"sweep": sweep, CHECK: sweep}, every_s=8.0))
        table = rig.table
        self._middles_m = np.array(
            [
                (x_m, y_m)
                for x_m in _places(table.x_min_m, table.x_max_m, STRIDE_M)
                for y_m in _places(table.y_min_m, table.y_max_m, LANE_M)
            ]
        )

    def known(self) -> dict[str, float]:
        """The quantities of the goals: also how much of the table has been swept."""
        known = super().known()
        if self.places_m:
            away_m = np.linalg.norm(self._middles_m[:, None] - np.array(self.places_m)[None], axis=2)
            known["table"] = float((away_m.min(axis=1) < REACH_M).mean())
        return known

    def outcome(self) -> Outcome:
        """Return the star list, tried on the pictures set aside.

        Raises:
            CalibrationRefusedError: Anchors or overlaps do not suffice.
        """
        anchors = _anchors(self.fitted, self.catalogue, self.camera)
        known_m = np.isfinite(self.catalogue.sigma_m) & (self.catalogue.sigma_m > 0.0)
        tape_m = float(np.median(self.catalogue.sigma_m[known_m])) if known_m.any() else ANCHOR_SIGMA_M
        names = [f"picture {number}" for number in range(1, len(self.fitted) + 1)]
        survey = survey_sweep(
            self.fitted, anchors, self.camera, names, tape_sigma_m=max(tape_m, ANCHOR_SIGMA_M), verify_every=0
        )
        found, sky = survey.outcome, survey.sky
        made = StarCatalogue(
            sky.ids, sky.star_m[:, 0].copy(), sky.star_m[:, 1].copy(), np.sqrt((sky.sigma_m**2).mean(axis=1))
        )
        after, before = self.judged(sky.camera, made), self.judged(self.camera, self.catalogue)
        warnings = (*found.warnings, *complaints(before, after))
        if after.rms_px > 1.1 * before.rms_px:
            warnings = (*warnings, "stars of the pictures set aside fit the rig's own list better")
        return Outcome(
            title=f"Star list by a sweep of {self.vehicle}, guided",
            summary=found.summary,
            quantities=found.quantities,
            residual=found.residual,
            notes={
                **found.notes,
                "anchored_by": [f"star {anchor.name} of the rig's list" for anchor in anchors],
                **{f"step_{step}": outcome for step, outcome in self.steps.outcomes.items()},
            },
            draw=found.draw,
            warnings=warnings,
            camera=found.camera,
            verification=numbers(before, after) | {"stars": Quantity(float(len(sky.ids)), math.nan, "1")},
            verified_by=f"{after.pictures} pictures that the list was made without",
            drawings=(_ceiling(survey, self.catalogue), star_drawing(before, after)),
            also={".csv": survey.catalogue_csv()},
        )


def _places(low_m: float, high_m: float, step_m: float) -> list[float]:
    length_m = max(0.0, high_m - low_m - 2.0 * MARGIN_M)
    count = max(2, math.ceil(length_m / step_m) + 1)
    step = (high_m - low_m - 2.0 * MARGIN_M) / (count - 1)
    return [low_m + MARGIN_M + step * number for number in range(count)]


def _anchors(pictures: Sequence[Spots], catalogue: StarCatalogue, camera: CameraCalibration) -> list[Anchor]:
    """Stars of the old list far from each other, each where a picture shows it.

    Raises:
        CalibrationRefusedError: No picture can be solved with that list.
    """
    sightings: dict[int, list[tuple[float, int, float, float]]] = {}
    tracker, middle_px = StarTracker(catalogue, camera), (camera.width / 2.0, camera.height / 2.0)
    for number, spots in enumerate(pictures):
        fix = tracker.solve(spots)
        if not isinstance(fix, PictureFix):
            continue
        for spot, star in zip(fix.spot_index.tolist(), fix.star_index.tolist(), strict=True):
            u_px, v_px = float(spots.u_px[spot]), float(spots.v_px[spot])
            away_px = math.dist((u_px, v_px), middle_px)
            sightings.setdefault(star, []).append((away_px, number, u_px, v_px))
    # where a star is nearest to the middle the pictures around show it, too
    seen = {star: min(rows)[1:] for star, rows in sightings.items() if len(rows) >= ANCHOR_SIGHTINGS}
    if len(seen) < LEAST_ANCHORS:
        raise CalibrationRefusedError(
            f"{len(seen)} stars of the rig's list were recognised often enough, {LEAST_ANCHORS} are needed "
            "to hold the frame"
        )
    stars = np.array(sorted(seen))
    place = np.column_stack((catalogue.x_m[stars], catalogue.y_m[stars]))
    chosen = [max(itertools.combinations(range(len(stars)), 2), key=lambda pair: _apart(place, pair))[0]]
    while len(chosen) < min(ANCHORS, len(stars)):  # each the farthest from those before it
        distance = np.linalg.norm(place[:, None] - place[None, chosen], axis=2).min(axis=1)
        chosen.append(int(distance.argmax()))
    return [
        Anchor(catalogue.ids[star], float(catalogue.x_m[star]), float(catalogue.y_m[star]), *seen[star])
        for star in stars[chosen].tolist()
    ]


def _apart(place: np.ndarray, pair: tuple[int, int]) -> float:
    return float(np.linalg.norm(place[pair[0]] - place[pair[1]]))


def _ceiling(survey: Survey, old: StarCatalogue) -> Drawing:
    sky = survey.sky
    return Drawing(
        "The ceiling",
        "x, m",
        "y, m",
        (
            Curve("the rig's list", old.x_m.tolist(), old.y_m.tolist(), "crosses"),
            Curve("found", sky.star_m[:, 0].tolist(), sky.star_m[:, 1].tolist()),
            Curve("where pictures were taken", sky.pose[:, 0].tolist(), sky.pose[:, 1].tolist(), "line"),
        ),
        is_to_scale=True,
    )


class SurveyWizard:
    """Makes guided surveys of the ceiling."""

    summary = (
        "Ceiling: the star list made anew from a sweep over the table, held by far stars of the old one."
    )

    def missing(self, rig: Rig, vehicle: str) -> str:
        """Return what the rig lacks."""
        return missing_camera(rig, vehicle)

    def begin(self, rig: Rig, vehicle: str) -> GuidedSurvey:
        """Begin a survey with the camera of a vehicle."""
        return GuidedSurvey(rig, vehicle)


WIZARD = SurveyWizard()
