"""Demo data of the star camera: a ceiling from many places, a sweep, turning in place."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firmware_emulator.demo.writing import star_camera_keys, write_frame, write_json, write_table
from firmware_emulator.sky.optics import CameraOptics
from firmware_emulator.sky.scene import build_sky
from firmware_emulator.sky.sensor import SensorSettings
from firmware_emulator.sky.sky_camera import Pose, Shutter, SkyCamera

OPTICS = CameraOptics(
    width_px=640,
    height_px=480,
    focal_px=(598.3, 599.6),
    centre_px=(316.8, 243.9),
    distortion=(-0.092, 0.048, -0.0007, 0.0011, 0.0),
    ceiling_height_m=2.2,
    offset_body_m=(-0.024, 0.022),
    yaw_rad=-0.028,
    tilt_x_rad=-0.0044,
    tilt_y_rad=0.0061,
)
LEDS, LEAST_APART_M = 130, 0.16
HALF_M = (2.1, 1.7)
ROOM_M = (1.0, 0.75)
TAPE_SIGMA_M, CLICK_SIGMA_PX = 1e-3, 0.4
WOBBLE_M = 5e-5
TRUTH = "frame,x_m,y_m,heading_rad"


def ceiling(folder: Path, seed: int) -> None:
    """Twelve pictures from anywhere."""
    rng = np.random.default_rng([seed, 1])
    leds = _leds(rng)
    places = [
        (*(rng.uniform(-1.0, 1.0, 2) * ROOM_M).tolist(), float(rng.uniform(-math.pi, math.pi)))
        for _ in range(12)
    ]
    _write_list(folder, leds)
    _draw(folder, OPTICS, leds, places, seed)


def sweep(folder: Path, seed: int) -> None:
    """Lanes with pictures that overlap; the camera's height is stated 5 % too low; two anchors."""
    rng = np.random.default_rng([seed, 2])
    leds = _leds(rng)
    places = []
    for lane, y_m in enumerate(np.linspace(-ROOM_M[1], ROOM_M[1], 4)):
        along = np.linspace(-ROOM_M[0], ROOM_M[0], 8)[:: 1 if lane % 2 == 0 else -1]
        places += [(float(x_m), float(y_m), float(rng.uniform(-math.pi, math.pi))) for x_m in along]
    names = _draw(folder, OPTICS, leds, places, seed)
    write_json(
        folder / "camera.json",
        star_camera_keys(replace(OPTICS, ceiling_height_m=0.95 * OPTICS.ceiling_height_m)),
    )
    rows = []
    for number, name in ((0, names[0]), (1, names[-1]), (2, names[7])):
        led, pixel = _in_the_middle(leds, places[names.index(name)])
        tape = leds[led] + TAPE_SIGMA_M * rng.standard_normal(2)
        click = pixel + CLICK_SIGMA_PX * rng.standard_normal(2)
        rows.append((number, *(f"{v:.4f}" for v in tape), name, *(f"{v:.1f}" for v in click)))
    write_table(folder / "anchors.csv", "id,x_m,y_m,frame,u,v", rows)
    write_table(folder / "ceiling_truth.csv", "id,x_m,y_m", _rows(leds))


def turn(folder: Path, seed: int) -> None:
    """Pictures every ten degrees, the first at heading 0."""
    rng = np.random.default_rng([seed, 3])
    leds = _leds(rng)
    places = [
        (*(WOBBLE_M * rng.standard_normal(2)).tolist(), math.remainder(math.radians(10.0 * k), math.tau))
        for k in range(36)
    ]
    _write_list(folder, leds)
    _draw(folder, OPTICS, leds, places, seed)


def _leds(rng: np.random.Generator) -> NDArray[np.float64]:
    """Irregular places (n, 2), none nearer to another than the least distance."""
    places = np.empty((0, 2))
    while len(places) < LEDS:
        candidate = rng.uniform(-1.0, 1.0, 2) * HALF_M
        if np.all(np.hypot(*(places - candidate).T) >= LEAST_APART_M):
            places = np.vstack([places, candidate])
    return places


def _draw(
    folder: Path, optics: CameraOptics, leds: NDArray[np.float64], places: Sequence[Pose], seed: int
) -> list[str]:
    """Write camera, frames and truth; return the names of the frames."""
    sky_seed, chip_seed = np.random.SeedSequence([seed, 4]).spawn(2)
    camera = SkyCamera(optics, build_sky(leds, sky_seed), Shutter(0.005), SensorSettings(), chip_seed)
    names = []
    for number, place in enumerate(places):
        names.append(write_frame(folder, number, camera.render(place, place, sequence=number)))
    write_json(folder / "camera.json", star_camera_keys(optics))
    rows = [(name, *(f"{value:.6f}" for value in place)) for name, place in zip(names, places, strict=True)]
    write_table(folder / "truth.csv", TRUTH, rows)
    return names


def _write_list(folder: Path, leds: NDArray[np.float64]) -> None:
    write_table(folder / "ceiling.csv", "id,x_m,y_m", _rows(leds))


def _rows(leds: NDArray[np.float64]) -> list[tuple[object, ...]]:
    return [(number, f"{x:.5f}", f"{y:.5f}") for number, (x, y) in enumerate(leds.tolist())]


def _in_the_middle(leds: NDArray[np.float64], place: Pose) -> tuple[int, NDArray[np.float64]]:
    """The LED nearest to the middle of a picture, and its pixel."""
    pixels, _ = OPTICS.project(leds, place)
    led = int(np.nanargmin(np.hypot(*(pixels - OPTICS.centre_px).T)))
    return led, pixels[led]
