"""Pictures of tips made without the product: disks by counting points of a fine grid, noise, rounding."""

import numpy as np

FINE = 16
"""Points a side that a pixel is counted on: coverage to 0.2 %."""


def disk_cover(width, height, u, v, radius):
    """Share of each pixel that a disk covers, (height, width); (0, 0) is the centre of the top-left pixel."""
    cover = np.zeros((height, width))
    left, right = max(0, int(u - radius) - 2), min(width, int(u + radius) + 4)
    top, bottom = max(0, int(v - radius) - 2), min(height, int(v + radius) + 4)
    if left >= right or top >= bottom:
        return cover
    offset = (np.arange(FINE) + 0.5) / FINE - 0.5
    x = (np.arange(left, right)[:, None] + offset).ravel()
    y = (np.arange(top, bottom)[:, None] + offset).ravel()
    inside = (x[None] - u) ** 2 + (y[:, None] - v) ** 2 < radius**2
    cover[top:bottom, left:right] = inside.reshape(bottom - top, FINE, right - left, FINE).mean(axis=(1, 3))
    return cover


def paint(pixels, radii, rng, size=(640, 480), background=10.0, level=210.0, noise=4.0):
    """A grey picture of tips."""
    width, height = size
    cover = np.zeros((height, width))
    for (u, v), radius in zip(pixels, radii, strict=True):
        cover = np.maximum(cover, disk_cover(width, height, u, v, radius))
    picture = background + (level - background) * cover + rng.normal(0.0, noise, (height, width))
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def tips(scene, rotation, position, diameter_m):
    """Pixels (n, 2) and radii (n,) of the tips of a scene."""
    pixels = scene.pixels(rotation, position)
    depth = rotation.apply(scene.points_m)[:, 2] + position[2]
    return pixels, 0.5 * diameter_m * scene.f_px / depth
