"""The star list from a sweep, checked by pictures that it was made without."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from calibration.outcome import Outcome, adjusting
from calibration.result import Quantity
from calibration.sky.figures import draw_survey
from calibration.sky.quantities import camera_quantities
from calibration.sky.residual_structure import ResidualStructure, find_structure
from calibration.sky.sky_adjustment import HEIGHT
from calibration.sky.star_list import star_list_text, star_row
from calibration.sky.survey.surveyed_sky import LENS, Anchor, SurveyedSky
from calibration.sky.survey.surveyed_sky import survey as survey_sky
from calibration.sky.survey.verification import Verification, none_of, sentence_of, verify
from groundstation.cli.progress import Progress, silent
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots

_NAMED_AT_MOST = 8


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """A surveyed ceiling with all that is to be reported of it.

    Attributes:
        outcome: Numbers, warnings, figure; its camera has the height (and lens) as found.
        sky: Stars and poses.
        verification: By pictures held out; None if none were.
    """

    outcome: Outcome
    sky: SurveyedSky
    verification: Verification | None

    def catalogue_csv(self) -> str:
        """The star list's text: ``id,x_m,y_m,std_x_m,std_y_m,times_seen``."""
        sky = self.sky
        order = np.argsort(np.asarray(sky.ids, dtype=object), kind="stable")
        return star_list_text(
            star_row(sky.ids[i], sky.star_m[i], sky.sigma_m[i], sky.times_seen[i]) for i in order
        )


def survey_sweep(
    pictures: Sequence[Spots],
    anchors: Sequence[Anchor],
    camera: CameraCalibration,
    names: Sequence[str],
    *,
    tape_sigma_m: float = 3e-3,
    is_lens_free: bool = False,
    verify_every: int = 6,
    progress: Progress = silent,
) -> Survey:
    """Survey a ceiling from the overlapping pictures of a slow sweep.

    Before the survey of all pictures the same is done without every so many of them; these are solved
    with the star list that they had no part in.

    Args:
        pictures: Spots of the pictures.
        anchors: At least two stars measured by tape, with a click in one picture each.
        camera: Lens and mount; its height may be 10 % off.
        names: Of the pictures, for people.
        tape_sigma_m: How well the tape was read, one sigma.
        is_lens_free: Calibrate lens and tilt from the same pictures.
        verify_every: Every so many pictures are held out; below 2 none are.
        progress: Told how it goes.

    Raises:
        SurveyError: Anchors or overlaps do not suffice.
    """
    free = LENS if is_lens_free else HEIGHT
    step = adjusting(progress)
    progress("linking pictures", math.nan)
    verification = None
    if verify_every > 1:
        needed = {anchor.frame for anchor in anchors}
        held = [i for i in range(verify_every - 1, len(pictures), verify_every) if i not in needed]
        blind = [none_of(spots) if i in held else spots for i, spots in enumerate(pictures)]
        part = survey_sky(blind, anchors, camera, tape_sigma_m=tape_sigma_m, free=free, progress=step)
        verification = verify(part, [pictures[i] for i in held])
    sky = survey_sky(pictures, anchors, camera, tape_sigma_m=tape_sigma_m, free=free, progress=step)
    used = sky.adjusted.used
    residual_px = sky.adjusted.residual_px[used]
    structure = find_structure(sky.seen.pixel[used], residual_px, camera.width, camera.height)
    warnings = (*_gaps(sky, anchors, names), *_misfit(structure, sky.camera, is_lens_free))
    return Survey(_outcome(sky, verification, structure, len(pictures), warnings), sky, verification)


def _gaps(sky: SurveyedSky, anchors: Sequence[Anchor], names: Sequence[str]) -> list[str]:
    """Which pictures and anchors hang on no picture of the surveyed part."""
    found = []
    if len(sky.part_sizes) > 1:
        left_out = sorted(set(range(len(names))) - set(sky.placed.tolist()))
        some = ", ".join(names[i] for i in left_out[:_NAMED_AT_MOST])
        some += ", ..." if len(left_out) > _NAMED_AT_MOST else ""
        found.append(
            f"the sweep has gaps; {len(left_out)} pictures do not overlap the surveyed part "
            f"and were left out ({some})"
        )
    found += [
        f"anchor '{anchor.name}' lies outside the surveyed part, unused"
        for anchor in anchors
        if anchor.name not in sky.anchors
    ]
    return found


def _misfit(structure: ResidualStructure, camera: CameraCalibration, is_lens_free: bool) -> list[str]:
    """What the residuals say about the camera's model."""
    if not structure.is_wrong:
        return []
    scale_mm = 1e3 * camera.ceiling_height_above_camera_m / camera.fx
    advice = (
        "although the lens was freed: is the table level, is the ceiling flat, did the mock-up stand still?"
        if is_lens_free
        else "the lens or the tilt of the mount is wrong: survey again with --lens"
    )
    return [
        f"the residuals depend on the place in the picture, {structure.systematic_px:.3f} px beside "
        f"{structure.noise_px:.3f} px of noise ({scale_mm * structure.systematic_px:.2f} mm on the ceiling), "
        f"{advice}"
    ]


def _outcome(
    sky: SurveyedSky,
    verification: Verification | None,
    structure: ResidualStructure,
    pictures: int,
    warnings: tuple[str, ...],
) -> Outcome:
    shape_m = float(np.median(sky.sigma_m))
    tape_m = float(np.sqrt((sky.tape_residual_m**2).sum(axis=1).mean()))
    height_m = sky.camera.ceiling_height_above_camera_m
    summary = (
        f"{len(sky.ids)} stars from {len(sky.placed)} of {pictures} pictures, "
        f"residual {sky.adjusted.rms_px:.3f} px, shape {1e3 * shape_m:.3f} mm (median sigma), "
        f"tape against pictures {1e3 * tape_m:.2f} mm, ceiling {height_m:.4f} m above the camera."
    )
    if verification is not None:
        summary = f"{sentence_of(verification)}\n{summary}"
    residual = {
        "reprojection_rms": Quantity(sky.adjusted.rms_px, math.nan, "px"),
        "systematic": Quantity(structure.systematic_px, math.nan, "px"),
        "tape_against_pictures": Quantity(tape_m, math.nan, "m"),
    }
    notes: dict[str, float | int | str | bool | Sequence[str]] = {
        "stars": len(sky.ids),
        "pictures": pictures,
        "pictures_placed": len(sky.placed),
        "anchors": sky.anchors,
        "is_lens_wrong": structure.is_wrong,
    }
    if verification is not None:
        residual["verification_rms"] = Quantity(verification.rms_m, math.nan, "m")
        residual["verification_star_rms"] = Quantity(verification.star_sigma_m, math.nan, "m")
        residual["verification_matched"] = Quantity(verification.matched_ratio, math.nan, "1")
        residual["verification_clipped"] = Quantity(verification.clipped_ratio, math.nan, "1")
        notes |= {"pictures_held_out": verification.pictures, "pictures_verified": verification.solved}
    quantities = camera_quantities(sky.camera, sky.adjusted.sigma_camera)
    quantities["star_std_median"] = Quantity(shape_m, math.nan, "m")
    residual_px = sky.adjusted.residual_px[sky.adjusted.used]
    verified_m = np.zeros((0, 2)) if verification is None else verification.residual_m
    return Outcome(
        title="Star list from a sweep",
        summary=summary,
        quantities=quantities,
        residual=residual,
        notes=notes,
        draw=partial(
            draw_survey,
            sky.star_m,
            sky.sigma_m,
            sky.times_seen,
            sky.pose,
            residual_px,
            structure,
            1e3 * verified_m,
        ),
        warnings=warnings,
        camera=sky.camera,
    )
