"""The pictures of a sweep as parts that hang together, and the part that the anchors are in."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from calibration.outcome import CalibrationRefusedError
from calibration.sky.survey.linking import LinkedMap, link
from calibration.sky.survey.overlap import as_plane
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.rays import CeilingRays

Index = NDArray[np.int64]

MIN_TIMES_SEEN = 2
"""A light seen in fewer pictures is no star."""

_CLICK_REACH_PX = 12.0
_GATES_PX = (1.5, 4.0, 12.0)  # between two sightings of one star; the wide ones forgive a wrong lens
_WELL_LINKED_RATIOS = (0.9, 0.5, 0.0)  # of the pictures in one part: no need of a gate wider than this
_TWIN_REACH = 4.0  # gates: a star that a narrow gate has split has its twin so near
_MAX_TWIN_RATIO = 0.05


class SurveyError(CalibrationRefusedError):
    """The sweep or its anchors do not give a catalogue; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Anchor:
    """A star measured by tape, and where it was clicked.

    Attributes:
        name: Its id.
        x_m: By tape, table.
        y_m: By tape, table.
        frame: Index of the picture of the click.
        u_px: Of the click.
        v_px: Of the click.
    """

    name: str
    x_m: float
    y_m: float
    frame: int
    u_px: float
    v_px: float


def link_pictures(pictures: Sequence[Spots], rays: CeilingRays) -> list[LinkedMap]:
    """String the pictures together, with a wider gate if the narrow one leaves too many apart.

    Returns:
        The parts into which the sweep falls, the one of most pictures first; usually one.

    Raises:
        SurveyError: Fewer than two pictures overlap.
    """
    points = [rays.look_up(p.u_px, p.v_px).q_body_m for p in pictures]
    best: list[LinkedMap] = []
    best_is_split = False
    for gate_px, well_linked_ratio in zip(_GATES_PX, _WELL_LINKED_RATIOS, strict=True):
        parts = link(points, gate_px * rays.scale_m_px)
        usable = sum(len(part.placed) for part in parts)
        is_split = bool(parts) and _twin_ratio(parts[0], gate_px * rays.scale_m_px) > _MAX_TWIN_RATIO
        if parts and (not best or best_is_split or len(parts[0].placed) > len(best[0].placed)):
            best, best_is_split = parts, is_split
        if best and not best_is_split and len(best[0].placed) >= max(2, well_linked_ratio * usable):
            break
    if not best or len(best[0].placed) < 2:
        raise SurveyError("no two pictures of the sweep overlap")
    return best


def _twin_ratio(part: LinkedMap, gate_m: float) -> float:
    """Give the share of stars that have a neighbour at arm's length with which they were never seen."""
    often = np.flatnonzero(np.bincount(part.star, minlength=len(part.star_m)) > MIN_TIMES_SEEN)
    if len(often) == 0:
        return 0.0
    frames = {int(star): set(part.frame[part.star == star].tolist()) for star in often}
    pairs = cKDTree(as_plane(part.star_m[often])).query_pairs(_TWIN_REACH * gate_m)
    twins = {
        i for pair in pairs if not frames[int(often[pair[0]])] & frames[int(often[pair[1]])] for i in pair
    }
    return len(twins) / len(often)


def part_with_anchors(
    parts: Sequence[LinkedMap], anchors: Sequence[Anchor], pictures: Sequence[Spots]
) -> tuple[LinkedMap, list[Anchor], Index]:
    """Give the largest part that holds two anchors, these anchors, and the stars that they are.

    Raises:
        SurveyError: No part holds two, or a click hits no star.
    """
    for part in parts:
        inside = [anchor for anchor in anchors if anchor.frame in part.placed]
        if len(inside) < 2 or len(part.placed) < 2:
            continue
        sweep = _without_rare_stars(part)
        named = np.array([_clicked(anchor, pictures, sweep) for anchor in inside], dtype=np.int64)
        if len(set(named.tolist())) < len(inside):
            raise SurveyError("two anchors were clicked on one star")
        return sweep, inside, named
    sizes = ", ".join(str(len(part.placed)) for part in parts[:6])
    raise SurveyError(
        f"the pictures hang together in parts of {sizes}{' and fewer' if len(parts) > 6 else ''}, and none "
        "of them holds two anchors: fill the gap with pictures that overlap, or click two anchors in one part"
    )


def _clicked(anchor: Anchor, pictures: Sequence[Spots], sweep: LinkedMap) -> int:
    """Give the star nearest to the click, among those that other pictures show, too."""
    row = np.flatnonzero(sweep.placed[sweep.frame] == anchor.frame)
    spots, spot = pictures[anchor.frame], sweep.spot[row]
    distance = np.hypot(spots.u_px[spot] - anchor.u_px, spots.v_px[spot] - anchor.v_px)
    if len(distance) == 0 or distance.min() > _CLICK_REACH_PX:
        raise SurveyError(
            f"anchor '{anchor.name}': no star within {_CLICK_REACH_PX:.0f} px of the click "
            f"({anchor.u_px:.1f}, {anchor.v_px:.1f}) that another picture shows, too"
        )
    return int(sweep.star[row[int(np.argmin(distance))]])


def _without_rare_stars(sweep: LinkedMap) -> LinkedMap:
    """Drop what was seen too rarely to be a star."""
    return only_stars(sweep, np.bincount(sweep.star, minlength=len(sweep.star_m)) >= MIN_TIMES_SEEN)


def only_stars(sweep: LinkedMap, keep: NDArray[np.bool_]) -> LinkedMap:
    """Give the same part with some of its stars only."""
    number = np.cumsum(keep) - 1
    kept = keep[sweep.star]
    return LinkedMap(
        sweep.pose,
        sweep.placed,
        sweep.star_m[keep],
        sweep.frame[kept],
        sweep.spot[kept],
        number[sweep.star[kept]],
    )
