"""What is measured of the part of a plain body that a lamp lights, column by column of the picture.

Of each lit column its brightness, and where it begins and ends: the light in a window over an edge says how
many of the window's rows are covered, whatever the lens blurs. Columns beside the patch belong to it, since
there is no light there.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.intensity import Background, background_of
from groundstation.relative_navigation.outlines import Blob, blobs_of
from groundstation.relative_navigation.sighting import Unseen

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

SIGMAS = 6.0
"""Of the noise: how far a pixel of the lit part stands above the background."""
RIM_PX = 30
LEAST_ROWS, LEAST_COLUMNS = 24, 6
RIVAL_SHARE = 0.15
"""Another patch with such a share of the largest one's area may be the body as well."""
SATURATED, FLOODED_SHARE = 250, 0.0005
"""Of the picture that is over-exposed: more is the lamp, or a body whose brightness tells nothing."""
EDGE_ROWS = 4
"""Half the window in which the light of an upper or lower edge is counted."""
EDGE_FLOOR_PX, PROFILE_FLOOR = 0.05, 0.01
"""What the model leaves of a perfect picture: of an edge, and of brightness as a share of the brightest."""
PLACE_FLOOR_PX = 0.05
"""The same of where a column lies: counts where the brightness is steep."""
CONTRAST_SIGMAS = 12.0
"""A column's level over its noise from which its edges are used."""
SPIKE_REACH, SPIKE_SIGMAS, MOST_SPIKES = 2, 5.0, 0.05
"""A column whose edge lies so far from the median of those around is spoilt, where few are."""
BLUR_PX = 0.8
"""Of the lens, standard deviation."""


@dataclass(frozen=True, slots=True, eq=False)
class LitPatch:
    """What is measured of the lit part, by columns.

    Attributes:
        columns: Of the profile, from some way outside the patch on the left to as far on the right, (n,).
        profile: Mean light over the rows in the middle, above the background, (n,).
        profile_sigma: Its noise and what the model leaves, (n,).
        profile_noise: Its noise alone, (n,).
        edge_columns: Those whose edges are sharp, (k,).
        upper, lower: Rows of the edges, (k,).
        edge_sigma: Of each, (k,).
    """

    columns: Floats
    profile: Floats
    profile_sigma: Floats
    profile_noise: Floats
    edge_columns: Floats
    upper: Floats
    lower: Floats
    edge_sigma: Floats


def measure_lit_part(picture: Picture) -> LitPatch | Unseen:
    """Measure the one lit body of a picture, or return why there is none.

    Args:
        picture: Grey, (h, w).
    """
    background = _dark(picture)
    if np.count_nonzero(picture >= SATURATED) > FLOODED_SHARE * picture.size:
        return Unseen("over-exposed: the lamp is in view, or it shines too bright")
    blob = _lit_blob(picture, background)
    return blob if isinstance(blob, Unseen) else _measured(picture, blob, background)


def _dark(picture: Picture) -> Background:
    """Background of a picture that a near body may fill by more than half: then its rim tells more."""
    above_and_below = np.concatenate((picture[:RIM_PX], picture[-RIM_PX:]))
    beside = np.concatenate((picture[:, :RIM_PX], picture[:, -RIM_PX:]), axis=1)
    parts = (picture, above_and_below, np.ascontiguousarray(beside))
    return min(map(background_of, parts), key=lambda found: found.level)


def _lit_blob(picture: Picture, background: Background) -> Blob | Unseen:
    """The one patch that may be the body."""
    level = math.ceil(background.level + SIGMAS * background.sigma)
    blobs = [blob for blob in blobs_of(picture, level) if blob.box[2] > 2 and blob.box[3] > 2]
    if not blobs:
        return Unseen("nothing is lit" if background.level < 40.0 else "nothing stands out of the background")
    areas = np.array([blob.box[2] * blob.box[3] for blob in blobs])
    blob = blobs[int(np.argmax(areas))]
    if np.sort(areas)[-2:][0] > RIVAL_SHARE * areas.max() and len(areas) > 1:
        return Unseen("more than one lit body is in view", is_ambiguous=True)
    left, top, right, bottom = blob.touches
    if blob.box[3] < LEAST_ROWS or blob.box[2] < LEAST_COLUMNS:
        return Unseen(f"the lit part has {blob.box[2]} x {blob.box[3]} px, too few to be measured")
    if top <= EDGE_ROWS or bottom >= picture.shape[0] - 1 - EDGE_ROWS:
        return Unseen("the upper or lower edge of the body is out of view")
    if left <= EDGE_ROWS or right >= picture.shape[1] - 1 - EDGE_ROWS:
        return Unseen("the edge of the picture cuts the lit part")
    return blob


def _measured(picture: Picture, blob: Blob, background: Background) -> LitPatch | Unseen:
    left, top, right, bottom = blob.touches
    margin = max(8, blob.box[2] // 8)
    first, last = max(0, left - margin), min(picture.shape[1] - 1, right + margin)
    columns = np.arange(first, last + 1)
    middle = slice(top + blob.box[3] // 4, bottom - blob.box[3] // 4)
    light = picture[middle, first : last + 1].astype(float) - background.level
    count = light.shape[0]
    profile = np.median(light, axis=0) if count < 8 else _trimmed_mean(light)
    noise = background.sigma**2 + np.maximum(profile, 0.0) * _shot_gain(light, profile, background)
    steep = PLACE_FLOOR_PX * np.abs(np.gradient(profile))
    sigma = np.sqrt(noise / count + (PROFILE_FLOOR * max(profile.max(), 1.0)) ** 2 + steep**2)
    lit = np.flatnonzero(profile > CONTRAST_SIGMAS * np.sqrt(noise / count) + 2.0 * background.sigma)
    lit = lit[(lit > 1) & (lit < len(columns) - 2)]
    if len(lit) < LEAST_COLUMNS:
        return Unseen("the lit part is too faint to be measured")
    upper, lower, spread = [], [], []
    rows = np.arange(picture.shape[0], dtype=float)
    for index in lit.tolist():
        ray = picture[:, columns[index]].astype(float) - background.level
        level = profile[index]
        above, below = _crossings(ray, level, top, bottom)
        inside = math.sqrt(noise[index]) / level
        found = []
        for rough, sign in ((above, 1.0), (below, -1.0)):
            low = max(0, round(rough) - EDGE_ROWS)
            window = slice(low, min(len(rows), round(rough) + EDGE_ROWS + 1))
            share = ray[window] / level
            # the light in the window says how many of its rows are covered: the edge, whatever the lens blurs
            covered = float(share.sum())
            found.append(rows[window][-1] + 0.5 - covered if sign > 0 else rows[window][0] - 0.5 + covered)
        upper.append(found[0])
        lower.append(found[1])
        spread.append(inside * math.sqrt(2.0 * EDGE_ROWS + 1.0))
    # the lens mixes neighbouring columns: where the brightness rises, what is seen lies on the brighter side
    moved = np.clip(BLUR_PX**2 * (np.gradient(profile) / np.maximum(profile, 1.0))[lit], -1.5, 1.5)
    bent = np.abs(np.gradient(np.gradient(upper))) * 0.5 * BLUR_PX**2
    unsure = np.abs(np.gradient(upper)) * np.abs(moved)
    edge_sigma = np.sqrt(np.square(spread) + EDGE_FLOOR_PX**2 + bent**2 + unsure**2)
    kept = _without_spikes((upper, lower), edge_sigma)
    if np.count_nonzero(kept) < LEAST_COLUMNS:
        return Unseen("the lit part is too faint to be measured")
    return LitPatch(
        columns.astype(float),
        profile,
        sigma,
        np.sqrt(noise / count),
        (columns[lit] + moved)[kept],
        np.array(upper)[kept],
        np.array(lower)[kept],
        edge_sigma[kept],
    )


def _without_spikes(edges: tuple[list[float], list[float]], sigma: Floats) -> NDArray[np.bool_]:
    """Which columns have edges like those beside them: a hot pixel in its window moves one edge alone."""
    kept = np.ones(len(sigma), dtype=bool)
    for edge in edges:
        padded = np.pad(np.array(edge), SPIKE_REACH, mode="reflect")
        around = np.lib.stride_tricks.sliding_window_view(padded, 2 * SPIKE_REACH + 1)
        kept &= np.abs(np.array(edge) - np.median(around, axis=1)) < SPIKE_SIGMAS * sigma
    is_few = np.count_nonzero(~kept) <= max(2, MOST_SPIKES * len(kept))
    return kept if is_few else np.ones(len(sigma), dtype=bool)


def _trimmed_mean(light: Floats) -> Floats:
    """Mean over the rows without the eighth at either end: a hot pixel does not count."""
    ordered = np.sort(light, axis=0)
    cut = len(ordered) // 8
    mean: Floats = ordered[cut : len(ordered) - cut].mean(axis=0)
    return mean


def _shot_gain(light: Floats, profile: Floats, background: Background) -> float:
    """How much the variance grows with the light, from the scatter of the rows."""
    bright = profile > 0.3 * profile.max()
    excess = float(np.median(light[:, bright].var(axis=0))) - background.sigma**2
    return max(0.0, excess / max(float(np.median(profile[bright])), 1.0))


def _crossings(ray: Floats, level: float, top: int, bottom: int) -> tuple[float, float]:
    """Rows where a column passes half its level, outermost ones around the patch."""
    low, high = max(0, top - 3), min(len(ray), bottom + 4)
    bright = np.flatnonzero(ray[low:high] > 0.5 * level)
    if not len(bright):
        return float(top), float(bottom)
    return float(low + bright[0]) - 0.5, float(low + bright[-1]) + 0.5
