"""Coloured circles in a picture from above: where each is on its plane, and how well that is known.

Coarse: at half resolution, after the light's colour has been divided out (the table and what stands on it are
mostly grey), saturated pixels are labelled per colour. Fine: each candidate is looked at once more in
full resolution. A pixel's *share* in the circle is its place between the colour around and the colour inside,
so that blur and mixed pixels at the rim count as what they are. Every pixel is carried to the plane of
the circles: in the picture a circle is an ellipse whose centre is not the circle's, on the plane it is round.

A whole circle (right area, round) is found by the centroid of its shares. What is not whole, because
something covers it, touches it or the picture ends, is tried as arcs of circles of the known radius.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.overhead.arcs import circles_of_rim
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.star_tracking.rays import undistort

Array = NDArray[np.float64]
Places = NDArray[np.complex128]
Picture = NDArray[np.uint8]

_SHRINK = 2
_HUE_TURN = 256
_MAX_CANDIDATES = 24  # of one colour: more are clutter, and the time for one picture is bounded
_MARGIN_PX = 8
_MIXED_PX = 2  # pixels at the rim are mixtures
_MIN_SHADED_PX = 12  # of its inside, to see how the light falls off over a circle
_MIN_SPREAD, _MAX_SPREAD = 0.85, 1.5  # second moments over those of a sharp circle; blur makes them larger
_CLUMP_PX = 4  # noise of neighbours runs together: colour filter, compression
_MIN_PAIRS = 20
_SUPPORT_PX = 3  # beyond the mask; the lens's blur ends there
_MIN_CONTRAST_DN = 12.0
_RING_PX = 4  # then comes the surroundings' colour


@dataclass(frozen=True, slots=True)
class ColourSettings:
    """What counts as a coloured circle.

    Attributes:
        hue_deg: Each colour's hue on the circle of 360, under white light.
        hue_half_width_deg: How far off it may be.
        min_saturation: Of 255.
        min_value: Of 255.
        area_ratio: A whole circle's area may be off by this share.
        max_elongation: Its second moments along two axes may differ by this factor.
        floor_px: What remains of a centre's error without any noise, per axis: colour filter, rounding.
    """

    hue_deg: tuple[tuple[str, float], ...] = (("red", 0.0), ("green", 120.0), ("blue", 225.0))
    hue_half_width_deg: float = 35.0
    min_saturation: int = 140
    min_value: int = 24
    area_ratio: float = 0.15
    max_elongation: float = 1.3
    floor_px: float = 0.035


@dataclass(frozen=True, slots=True, eq=False)
class SeenCircle:
    """One circle on its plane.

    Attributes:
        colour: Its name.
        place_m: Centre x + iy, table frame.
        covariance_m2: Covariance (2, 2) of the centre.
        is_whole: False where only part of the rim was seen.
    """

    colour: str
    place_m: complex
    covariance_m2: Array
    is_whole: bool


class PlaneView:
    """Pixel to plane for one camera.

    Args:
        camera: The camera; the rays of all its pixels become a table.
    """

    def __init__(self, camera: OverheadCamera) -> None:
        self.camera = camera
        v, u = np.indices((camera.height, camera.width)).reshape(2, -1).astype(np.float64)
        x, y, _ = undistort(camera, u, v)
        ray = np.stack((x, y, np.ones_like(x)), axis=1) @ camera.table_from_camera().T
        slope = (ray[:, 0] + 1j * ray[:, 1]) / ray[:, 2]
        self._slope: Places = np.asarray(slope.reshape(camera.height, camera.width), np.complex128)

    def places(self, rows: slice, columns: slice, height_m: float) -> Places:
        """Points x + iy of the plane z = height of the table that the pixels of a window look at."""
        x, y, z = self.camera.position_table_m
        return np.asarray(complex(x, y) + (height_m - z) * self._slope[rows, columns], dtype=np.complex128)

    def pitch_m(self, row: int, column: int, height_m: float) -> float:
        """Side of a pixel on the plane, there."""
        row, column = min(row, self.camera.height - 2), min(column, self.camera.width - 2)
        corner = self.places(slice(row, row + 2), slice(column, column + 2), height_m)
        right, down = corner[0, 1] - corner[0, 0], corner[1, 0] - corner[0, 0]
        return float(np.sqrt(abs((right * np.conj(down)).imag)))


def find_circles(
    image: Picture, view: PlaneView, height_m: float, radius_m: float, settings: ColourSettings
) -> list[SeenCircle]:
    """Find the coloured circles of one size at one height.

    Args:
        image: Picture (h, w, 3), uint8, blue-green-red, of the camera's size.
        view: The camera.
        height_m: Of the circles above the table.
        radius_m: Of the circles.
        settings: What counts as a coloured circle.
    """
    white = _white_balance(image)
    small = cv2.resize(image, None, fx=1 / _SHRINK, fy=1 / _SHRINK, interpolation=cv2.INTER_AREA)
    masks = _colour_masks(np.asarray(cv2.LUT(small, white), np.uint8), settings)
    found: list[SeenCircle] = []
    for colour, mask in masks.items():
        count, _, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
        boxes = stats[1:count]
        boxes = boxes[np.argsort(-boxes[:, cv2.CC_STAT_AREA], kind="stable")]
        kept = 0
        for left, top, width, height, area in boxes.tolist():
            row = min(_SHRINK * (top + height // 2), view.camera.height - 1)
            column = min(_SHRINK * (left + width // 2), view.camera.width - 1)
            whole = np.pi * (radius_m / view.pitch_m(row, column, height_m) / _SHRINK) ** 2
            if not 0.25 * whole < area < 8.0 * whole:
                continue
            kept += 1
            if kept > _MAX_CANDIDATES:
                break
            window = _window(image, (left, top, width, height))
            found += _look_closer(image, white, view, window, colour, height_m, radius_m, settings)
    return found


def _white_balance(image: Picture) -> Picture:
    """Table (1, 256, 3) for cv2.LUT that makes what is mostly in the picture grey."""
    sample = image[::8, ::8].reshape(-1, 3)
    brightest = sample.max(axis=1).astype(np.int16)
    grey = sample[(brightest > 25) & (brightest - sample.min(axis=1) < 0.5 * brightest)]
    gain = np.ones(3)
    if len(grey) >= 100:
        medians = np.maximum(np.median(grey, axis=0), 1.0)
        gain = np.clip(medians.mean() / medians, 0.5, 2.0)
    levels = np.arange(256.0)[:, None] * gain
    return np.rint(np.minimum(levels, 255.0)).astype(np.uint8)[None]


def _colour_masks(balanced: Picture, settings: ColourSettings) -> dict[str, Picture]:
    hsv = cv2.cvtColor(balanced, cv2.COLOR_BGR2HSV_FULL)
    half = round(settings.hue_half_width_deg * _HUE_TURN / 360.0)
    masks: dict[str, Picture] = {}
    for name, centre_deg in settings.hue_deg:
        centre = round(centre_deg * _HUE_TURN / 360.0)
        low, high = centre - half, centre + half
        spans = [(max(low, 0), min(high, 255))]
        if low < 0:
            spans.append((low + _HUE_TURN, 255))
        if high > _HUE_TURN - 1:
            spans.append((0, high - _HUE_TURN))
        mask = np.zeros(balanced.shape[:2], np.uint8)
        for first, last in spans:
            floor = (first, settings.min_saturation, settings.min_value)
            mask |= np.asarray(cv2.inRange(hsv, floor, (last, 255, 255)), np.uint8)
        masks[name] = mask
    return masks


def _window(image: Picture, box: Sequence[int]) -> tuple[slice, slice]:
    left, top, width, height = (_SHRINK * side for side in box)
    rows = slice(max(0, top - _MARGIN_PX), min(image.shape[0], top + height + _MARGIN_PX))
    return rows, slice(max(0, left - _MARGIN_PX), min(image.shape[1], left + width + _MARGIN_PX))


def _look_closer(
    image: Picture,
    white: Picture,
    view: PlaneView,
    window: tuple[slice, slice],
    colour: str,
    height_m: float,
    radius_m: float,
    settings: ColourSettings,
) -> list[SeenCircle]:
    """Find the circles of one candidate in full resolution."""
    pixels = np.asarray(cv2.LUT(np.ascontiguousarray(image[window]), white), np.uint8)
    mask = _largest(_colour_masks(pixels, settings)[colour])
    shares = _shares(pixels, mask)
    if shares is None:
        return []
    places = view.places(*window, height_m)
    pitch_m = view.pitch_m(
        (window[0].start + window[0].stop) // 2, (window[1].start + window[1].stop) // 2, height_m
    )
    whole = _whole(shares, places, radius_m, settings)
    if whole is not None:
        centre, covariance = whole
        return [SeenCircle(colour, centre, covariance + np.eye(2) * (settings.floor_px * pitch_m) ** 2, True)]
    arcs = circles_of_rim(shares.share, places, radius_m, pitch_m)
    return [SeenCircle(colour, arc.place_m, arc.covariance_m2, False) for arc in arcs]


def _largest(mask: Picture) -> Picture:
    """The largest patch of a mask: a neighbour in the window is a candidate of its own."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    if count < 2:
        return np.zeros_like(mask)
    return np.asarray(labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA])), dtype=np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class _Shares:
    """How much of each pixel of a window belongs to the circle.

    Attributes:
        share: 0 to 1, shape (h, w).
        noisy: Where the share was measured and not known; shape (h, w).
        noise: Standard deviation of one pixel's share.
        clump: Over how many pixels the noise runs together: the camera makes three colours of one per pixel.
    """

    share: Array
    noisy: NDArray[np.bool_]
    noise: float
    clump: float


def _shares(pixels: Picture, mask: Picture) -> _Shares | None:
    """Give each pixel's place between the colour around and the colour inside; None if there is no inside.

    The mask by hue holds mixed pixels too; the second round goes by the shares of the first.
    """
    values = pixels.astype(np.float64)
    half = mask
    for _ in range(2):
        inside = _eroded(half) > 0
        near = cv2.dilate(half, _DISC3, iterations=_SUPPORT_PX) > 0
        ring = (cv2.dilate(half, _DISC3, iterations=_SUPPORT_PX + _RING_PX) > 0) & ~near
        if inside.sum() < 4 or ring.sum() < 12:
            return None
        background = np.median(values[ring], axis=0)
        contrast = np.median(values[inside], axis=0) - background
        contrast -= contrast.mean()  # grey neighbours (table, plate, shadow) differ in brightness only
        length2 = float(contrast @ contrast)
        if length2 < _MIN_CONTRAST_DN**2:
            return None
        raw = (values - background) @ contrast / length2
        half = _largest(((raw > 0.5) & near).astype(np.uint8))
    raw = raw / _shading(raw, inside)
    share = np.where(near, raw, 0.0)
    share[inside] = 1.0
    around, within = raw[ring], raw[inside] - np.median(raw[inside])
    noise = 1.4826 * float(np.sqrt(np.median(np.abs(around)) * np.median(np.abs(within)) + 1e-12))
    return _Shares(share, near & ~inside, noise, _clump(raw, ring))


def _eroded(mask: Picture) -> Picture:
    """Leave off the rim's mixed pixels; what the window cuts is rim too."""
    border = cv2.BORDER_CONSTANT
    return np.asarray(
        cv2.erode(mask, _DISC3, iterations=_MIXED_PX, borderType=border, borderValue=0), np.uint8
    )


def _shading(raw: Array, inside: NDArray[np.bool_]) -> Array:
    """Give the colour's brightness over the window: what darkens to one side would shift the rim."""
    rows, columns = np.nonzero(inside)
    height, width = raw.shape
    down = np.broadcast_to(np.arange(height)[:, None] - rows.mean(), raw.shape)
    right = np.broadcast_to(np.arange(width) - columns.mean(), raw.shape)
    plane = np.stack((np.ones(raw.shape), down, right), axis=-1)
    if inside.sum() < _MIN_SHADED_PX:
        return np.full(raw.shape, float(np.median(raw[inside])))
    known = plane[inside]
    slope = np.linalg.solve(known.T @ known, known.T @ raw[inside])
    return np.asarray(np.maximum(plane @ slope, 0.5))


def _clump(raw: Array, ring: NDArray[np.bool_]) -> float:
    """How much larger than for independent noise the variance of a sum over pixels is."""
    limit = 4.0 * 1.4826 * float(np.median(np.abs(raw[ring]))) + 1e-9
    usable = ring & (np.abs(raw) < limit)
    level = np.where(usable, raw, 0.0)
    variance = float((level[usable] ** 2).mean()) + 1e-12
    factor = 1.0
    for values, known in ((level, usable), (level.T, usable.T)):
        along = 1.0
        for lag in range(1, _CLUMP_PX + 1):
            both = known[lag:] & known[:-lag]
            pairs = int(both.sum())
            if pairs < _MIN_PAIRS:
                break
            correlation = float((values[lag:] * values[:-lag])[both].sum()) / pairs / variance
            along += 2.0 * min(max(correlation, 0.0), 1.0)
        factor *= along
    return factor


def _whole(
    shares: _Shares, places: Places, radius_m: float, settings: ColourSettings
) -> tuple[complex, Array] | None:
    """Give centre and covariance (2, 2) if the shares are those of one whole circle."""
    right, down = np.gradient(places, axis=1), np.gradient(places, axis=0)
    area = np.abs((right * np.conj(down)).imag)  # of each pixel on the plane, m^2
    weight = shares.share * area
    total = float(weight.sum())
    if total <= 0.0 or abs(total / (np.pi * radius_m**2) - 1.0) > settings.area_ratio:
        return None
    centre = complex((weight * places).sum() / total)
    off = places - centre
    moments = np.cov(
        np.stack((off.real.ravel(), off.imag.ravel())), aweights=np.maximum(weight, 0.0).ravel(), bias=True
    )
    spread = np.linalg.eigvalsh(moments) / (0.25 * radius_m**2)
    if spread[0] < _MIN_SPREAD or spread[1] > _MAX_SPREAD or spread[1] > settings.max_elongation * spread[0]:
        return None
    edge = shares.noisy
    lever = np.stack((off.real[edge], off.imag[edge])) * (area[edge] * shares.noise / total)
    return centre, np.asarray(shares.clump * (lever @ lever.T))


_DISC3 = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
