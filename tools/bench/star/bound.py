"""Errors beside the least that the light of the pictures allows (Cramer-Rao), standing and blurred by motion.

The bound is that of the pose, from every pixel near the stars that lie wholly inside the picture, each star's
light being unknown. It is counted from the emulator's own optics and noise.
"""

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bench.limits import at_most, between, plain
from bench.rows import Bench, Row
from bench.star.laboratory import CAMERA_FILE, CEILING_FILE, Laboratory
from firmware_emulator.sky.spots import add_spots, steps_of
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Detector
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

Floats = NDArray[np.float64]

SEED = 5
KINDS: Mapping[str, tuple[float, float, float]] = MappingProxyType(
    {
        "standing": (0.0, 0.0, 0.01),
        "slow": (0.3, 0.4, 0.033),
        "blurred": (1.0, 1.3, 0.033),
        "long streaks": (1.0, 2.6, 0.05),
    }
)
"""Largest speed along each axis m/s, turn rate rad/s, exposure s."""
MUST: Mapping[str, float] = MappingProxyType({"standing": 1.1, "slow": 1.15, "blurred": 1.1})
PICTURES = 3
"""Times as many as of other kinds: the ratio's own error is then 2 %."""
FALSE_M = 0.02
MARGIN_PX = 6
SATURATION_DN = 250.0
STEP = 1e-4
"""m and rad, for derivatives."""


def measure(bench: Bench) -> list[Row]:
    """Every kind of motion."""
    tracker = StarTracker(StarCatalogue.load(CEILING_FILE), CameraCalibration.load(CAMERA_FILE))
    find, laboratory = Detector().find, Laboratory(SEED)
    rows: list[Row] = []
    for kind, (speed, turn, exposure_s) in KINDS.items():
        errors, bounds, squares, count = [], [], [], PICTURES * bench.frames
        for number, pose in enumerate(laboratory.poses(count)):
            velocity = laboratory.rng.uniform(-1.0, 1.0, 3) * (speed, speed, turn)
            fix = tracker.solve(find(laboratory.picture(pose, velocity, exposure_s)))
            if number % 50 == 0:
                bench.say(f"star: {kind}, {number} of {count} pictures")
            if not isinstance(fix, PictureFix):
                continue
            error = np.subtract((fix.x_m, fix.y_m, fix.heading_rad), pose)
            error[2] = np.angle(np.exp(1j * error[2]))
            errors.append(error)
            bounds.append(np.diag(bound(laboratory, pose, velocity * exposure_s)))
            squares.append(float(error @ np.linalg.solve(fix.covariance, error)) / 3.0)
        rows += _rows(kind, np.array(errors), np.array(bounds), float(np.mean(squares)), count)
    return rows


def _rows(kind: str, errors: Floats, bounds: Floats, squares: float, count: int) -> list[Row]:
    ratio = np.sqrt(np.mean(errors**2, axis=0) / np.mean(bounds, axis=0))
    position = np.sqrt(np.mean(np.sum(errors[:, :2] ** 2, axis=1)) / np.mean(bounds[:, :2].sum(axis=1)))
    false = int(np.count_nonzero(np.hypot(errors[:, 0], errors[:, 1]) > FALSE_M))
    what = f"star: position error over its bound, {kind}"
    note = f"heading {ratio[2]:.3g}; {len(errors)} of {count} identified, {false} false"
    limited = (
        at_most(what, position, MUST[kind], note=note) if kind in MUST else plain(what, position, "", note)
    )
    return [
        limited,
        between(f"star: squared errors over reported covariance, by 3, {kind}", squares, 0.8, 1.25),
    ]


def bound(laboratory: Laboratory, pose: Floats, path: Floats) -> Floats:
    """Least covariance (3, 3) of the pose at the middle of a motion ``path`` (m, m, rad), LEDs all alight."""
    optics, settings = laboratory.optics, laboratory.settings
    size = np.array([optics.width_px, optics.height_px])
    leds, shine = laboratory.leds, laboratory.sky.brightness
    ends, _ = _pixels(laboratory, pose, path, leds, 3)
    inside = np.all((ends > MARGIN_PX) & (ends < size - 1 - MARGIN_PX), axis=(1, 2))
    leds, shine = leds[inside], shine[inside]
    steps = steps_of(float(1.5 * np.linalg.norm(ends[inside, -1] - ends[inside, 0], axis=1).max()), 1.0)
    middle, cosine = _pixels(laboratory, pose, path, leds, steps)
    falloff = np.mean(cosine, axis=1) ** 4
    moved = [
        [_pixels(laboratory, pose + sign * STEP * axis, path, leds, steps)[0] for sign in (1.0, -1.0)]
        for axis in np.eye(3)
    ]
    on_body, _ = optics.ceiling_in_body(middle.mean(axis=1))
    c, s = np.cos(pose[2]), np.sin(pose[2])
    diffuse = laboratory.sky.diffuse_light(on_body @ np.array([[c, s], [-s, c]]) + pose[:2])
    dark_dn = settings.ambient_dn * falloff * diffuse
    read_dn2 = (settings.read_noise_e / settings.gain_e_dn) ** 2 + 1.0 / 12.0  # and rounding
    information = np.zeros((3, 3))
    for star, (flux, dark) in enumerate(zip(settings.led_flux_dn * shine * falloff, dark_dn, strict=True)):
        draw = partial(_draw, middle[star], flux, settings.psf_sigma_px)
        light = draw(middle[star])
        slopes = [(draw(ahead[star]) - draw(behind[star])) / (2.0 * STEP) for ahead, behind in moved]
        slope = np.array([*slopes, light / flux])
        is_measured = light + dark + settings.black_dn < SATURATION_DN
        normal = (slope * is_measured / (read_dn2 + (light + dark) / settings.gain_e_dn)) @ slope.T
        information += normal[:3, :3] - np.outer(normal[:3, 3], normal[:3, 3]) / normal[3, 3]
    return np.linalg.inv(information)


def _draw(near: Floats, flux: float, sigma_px: float, points: Floats) -> Floats:
    """Light (pixels,) of one star along its points (steps, 2), in a patch round those it has here."""
    corner = np.floor(near.min(axis=0)).astype(int) - MARGIN_PX
    width, height = np.ceil(near.max(axis=0)).astype(int) + MARGIN_PX - corner
    drawn = np.zeros((height, width), np.float32)
    add_spots(drawn, points[None] - corner, np.array([flux]), sigma_px)
    return drawn.ravel().astype(float)


def _pixels(
    laboratory: Laboratory, pose: Floats, path: Floats, leds: Floats, steps: int
) -> tuple[Floats, Floats]:
    """Pixels (n, steps, 2) and cosines of LEDs at equal times of the exposure."""
    share = (np.arange(steps) + 0.5) / steps - 0.5
    at = pose + share[:, None] * path
    return laboratory.optics.project(leds[:, None], (at[:, 0], at[:, 1], at[:, 2]))
