"""The overhead alternative: a camera over the table finds mock-ups by three coloured circles each.

Coloured pixels are labelled per colour; every pixel is carried to the plane of the circles, where the
centroid of its area is that of the true circle (in the picture a circle is an ellipse whose centre is
not the circle's). Triples of blobs that fit a mock-up's pattern of distances, the right way round,
give its pose by least squares, with covariance; several mock-ups are told apart by their patterns.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from calibration.camera.survey.overlap import rigid_fit
from groundstation.star_tracking.rays import undistort

Array = NDArray[np.float64]

_PIXEL_SIGMA = 0.29  # a pixel counted as in or out of a circle: uniform rounding, 1/sqrt(12)


@dataclass(frozen=True, slots=True, eq=False)
class OverheadCamera:
    """A camera that looks down on the table.

    Attributes:
        fx: Focal length, px.
        fy: Focal length, px.
        cx: Principal point, px.
        cy: Principal point, px.
        distortion: k1, k2, p1, p2, k3 of OpenCV's model.
        table_from_camera: Rotation matrix (3, 3); its columns are the camera axes in the table.
        position_table_m: Optical centre (x, y, z) in the table.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float]
    table_from_camera: Array
    position_table_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Circle:
    """One circle on a mock-up: colour by name, centre in the body frame (m)."""

    colour: str
    x_body_m: float
    y_body_m: float


@dataclass(frozen=True, slots=True)
class Livery:
    """The three circles of one mock-up."""

    vehicle: str
    circles: tuple[Circle, Circle, Circle]
    height_table_m: float
    radius_m: float

    def __post_init__(self) -> None:
        a, b, c = (complex(circle.x_body_m, circle.y_body_m) for circle in self.circles)
        if abs(((b - a) * np.conj(c - a)).imag) < 1e-4:
            raise ValueError(f"the circles of '{self.vehicle}' lie on one line")
        if not self.radius_m > 0.0:
            raise ValueError(f"the circles of '{self.vehicle}' need a radius")


@dataclass(frozen=True, slots=True)
class ColourSettings:
    """What counts as a colour.

    Attributes:
        hue_deg: Centre of each colour's hue, 0 to 360.
        hue_half_width_deg: Half width of each.
        min_saturation: Of 255.
        min_value: Of 255.
        area_ratio: A blob's area may differ from the circle's by this factor.
        tolerance_m: Distances within a pattern may be off by so much.
        pixel_sigma: Error of one pixel's share in a circle; sets the covariance.
    """

    hue_deg: tuple[tuple[str, float], ...] = (("red", 0.0), ("green", 120.0), ("blue", 240.0))
    hue_half_width_deg: float = 25.0
    min_saturation: int = 90
    min_value: int = 50
    area_ratio: float = 2.0
    tolerance_m: float = 0.01
    pixel_sigma: float = _PIXEL_SIGMA


@dataclass(frozen=True, slots=True, eq=False)
class OverheadFix:
    """Pose of one mock-up: body origin and heading in the table, covariance (3, 3), misfit RMS."""

    vehicle: str
    x_m: float
    y_m: float
    heading_rad: float
    cov: Array
    misfit_m: float


@dataclass(frozen=True, slots=True, eq=False)
class _Blob:
    """A coloured blob on the plane of the circles: centre, one sigma per axis, area."""

    place: complex
    std_m: float
    area_m2: float


def find_mock_ups(
    image: NDArray[np.uint8],
    camera: OverheadCamera,
    liveries: Sequence[Livery],
    settings: ColourSettings | None = None,
) -> list[OverheadFix]:
    """Find the mock-ups of a colour picture.

    Args:
        image: Picture (h, w, 3), uint8, blue-green-red.
        camera: The overhead camera.
        liveries: The circles of the mock-ups that may be there.
        settings: What counts as a colour.

    Raises:
        ValueError: The picture is not 8-bit colour.
    """
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        raise ValueError(f"expected an 8-bit colour picture, found {image.shape} of {image.dtype}")
    settings = settings or ColourSettings()
    masks = _colour_masks(image, settings)
    found: list[tuple[float, OverheadFix, list[tuple[str, complex]]]] = []
    for livery in liveries:
        blobs = {
            colour: _blobs(masks[colour], camera, livery, settings)
            for colour in {circle.colour for circle in livery.circles}
            if colour in masks
        }
        found += _fits(livery, blobs, settings)
    found.sort(key=lambda item: item[0])
    fixes: list[OverheadFix] = []
    taken: list[tuple[str, complex]] = []
    for _, fix, used in found:
        is_known = any(fix.vehicle == other.vehicle for other in fixes)
        is_used = any(
            colour == other and abs(place - at) < settings.tolerance_m
            for colour, place in used
            for other, at in taken
        )
        if not is_known and not is_used:
            fixes.append(fix)
            taken += used
    return fixes


def to_plane(camera: OverheadCamera, u_px: Array, v_px: Array, height_m: float) -> NDArray[np.complex128]:
    """Carry pixels (n,) to the plane z = height of the table, as x + iy."""
    x, y, _ = undistort(camera, u_px, v_px)
    ray = np.stack((x, y, np.ones_like(x)), axis=1) @ camera.table_from_camera.T
    origin = np.asarray(camera.position_table_m)
    reach = (height_m - origin[2]) / ray[:, 2]
    at = origin[:2] + reach[:, None] * ray[:, :2]
    return np.asarray(at[:, 0] + 1j * at[:, 1], dtype=np.complex128)


def _colour_masks(image: NDArray[np.uint8], settings: ColourSettings) -> dict[str, NDArray[np.uint8]]:
    hue, saturation, value = cv2.split(cv2.cvtColor(image, cv2.COLOR_BGR2HSV_FULL))
    vivid = (saturation >= settings.min_saturation) & (value >= settings.min_value)
    half = settings.hue_half_width_deg * 256.0 / 360.0
    masks = {}
    for name, centre_deg in settings.hue_deg:
        off = (hue.astype(np.int16) - round(centre_deg * 256.0 / 360.0) + 128) % 256 - 128
        masks[name] = (vivid & (np.abs(off) <= half)).astype(np.uint8)
    return masks


def _blobs(
    mask: NDArray[np.uint8], camera: OverheadCamera, livery: Livery, settings: ColourSettings
) -> list[_Blob]:
    """Give the blobs of one colour whose area could be a circle of the livery."""
    count, labels = cv2.connectedComponentsWithAlgorithm(mask, 8, cv2.CV_16U, cv2.CCL_BBDT)
    where = np.flatnonzero(mask.ravel())
    label = np.asarray(labels).ravel()[where]
    row = where // mask.shape[1]
    u, v = (where - row * mask.shape[1]).astype(np.float64), row.astype(np.float64)
    goal = np.pi * livery.radius_m**2
    blobs = []
    for number in range(1, count):
        mine = label == number
        if int(mine.sum()) < 9:
            continue
        place = to_plane(camera, u[mine], v[mine], livery.height_table_m)
        right = to_plane(camera, u[mine] + 1.0, v[mine], livery.height_table_m)
        down = to_plane(camera, u[mine], v[mine] + 1.0, livery.height_table_m)
        share = np.abs(((right - place) * np.conj(down - place)).imag)  # area of each pixel, m^2
        area = float(share.sum())
        if not goal / settings.area_ratio < area < goal * settings.area_ratio:
            continue
        centre = complex((share @ place) / area)
        # Only rim pixels err; there are about 2 sqrt(pi n) of them, one radius from the centre.
        pixels = float(mine.sum())
        rim = 2.0 * np.sqrt(np.pi * pixels)
        pitch = np.sqrt(area / pixels)
        std = settings.pixel_sigma * np.sqrt(rim / 2.0) * np.sqrt(pixels / np.pi) * pitch / pixels
        blobs.append(_Blob(centre, float(std), area))
    return blobs


def _fits(
    livery: Livery, blobs: dict[str, list[_Blob]], settings: ColourSettings
) -> list[tuple[float, OverheadFix, list[tuple[str, complex]]]]:
    """Give every triple of blobs that fits the livery: misfit, fix, and the blobs used."""
    body = np.array([complex(circle.x_body_m, circle.y_body_m) for circle in livery.circles])
    choices = [blobs.get(circle.colour, []) for circle in livery.circles]
    found = []
    for triple in product(*choices):
        if len({id(blob) for blob in triple}) < len(triple):
            continue
        place = np.array([blob.place for blob in triple])
        sides = np.abs(place - np.roll(place, 1)) - np.abs(body - np.roll(body, 1))
        if float(np.abs(sides).max()) > settings.tolerance_m:
            continue
        turn, shift = rigid_fit(body, place)
        residual = np.abs(turn * body + shift - place)
        misfit = float(np.sqrt((residual**2).mean()))
        if misfit > settings.tolerance_m:
            continue  # the mirror image has the same sides
        fix = OverheadFix(
            livery.vehicle,
            shift.real,
            shift.imag,
            float(np.angle(turn)),
            _covariance(turn * body, np.array([blob.std_m for blob in triple])),
            misfit,
        )
        used = [(c.colour, blob.place) for c, blob in zip(livery.circles, triple, strict=True)]
        found.append((misfit, fix, used))
    return found


def _covariance(arm_m: NDArray[np.complex128], std_m: Array) -> Array:
    """Covariance of (x, y, heading) from points at ``arm_m`` of the body origin, table axes."""
    information = np.zeros((3, 3))
    for arm, std in zip(arm_m, std_m, strict=True):
        lever = np.array([[1.0, 0.0, -arm.imag], [0.0, 1.0, arm.real]])
        information += lever.T @ lever / std**2
    return np.asarray(np.linalg.inv(information))
