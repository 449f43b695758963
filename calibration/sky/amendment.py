"""A star list brought up to date by what the watchdog of the sky found.

What counts is the last word on each star and each light: one that died and shines again stays as it
was. Stars that are dead are struck off, moved ones get their new place, lights that hang where no star
is listed are added. Several mock-ups' words on one place are averaged by their covariances.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from calibration.outcome import CalibrationRefusedError
from groundstation.star_tracking.sky_change import Change, SkyChange

SAME_LIGHT_M = 0.015
"""Two findings so near to each other are of one light."""


class AmendmentError(CalibrationRefusedError):
    """The findings are not about this star list; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class NewPlace:
    """Where a star hangs by the watchdog.

    Attributes:
        name: Its id in the list; new ones are numbered on.
        x_m: Table.
        y_m: Table.
        sigma_x_m: One sigma.
        sigma_y_m: One sigma.
        times_seen: Sightings behind it.
    """

    name: str
    x_m: float
    y_m: float
    sigma_x_m: float
    sigma_y_m: float
    times_seen: int


@dataclass(frozen=True, slots=True)
class Amendment:
    """What to change in a star list.

    Attributes:
        struck: Ids of dead stars.
        moved: Listed stars with their new places.
        added: Lights that were not listed.
    """

    struck: tuple[str, ...]
    moved: tuple[NewPlace, ...]
    added: tuple[NewPlace, ...]


def propose(names: Sequence[str], found: Iterable[tuple[str, SkyChange]], min_sightings: int) -> Amendment:
    """Sum up what was found.

    Args:
        names: Ids of the star list.
        found: Who found it (a vehicle's name) and what, in the order of finding.
        min_sightings: Lights seen less often are not added.

    Raises:
        AmendmentError: A finding names a star that is not in the list.
    """
    life: dict[tuple[str, str], SkyChange] = {}
    place: dict[tuple[str, str], SkyChange] = {}
    lights: list[tuple[str, SkyChange]] = []
    listed = set(names)
    for finder, change in found:
        if not change.star:
            lights = [(who, old) for who, old in lights if who != finder or not _is_one(old, change)]
            if change.change is Change.APPEARED:
                lights.append((finder, change))
            continue
        if change.star not in listed:
            raise AmendmentError(f"star '{change.star}' {change.change.value} but is not in the list")
        (place if change.change in (Change.MOVED, Change.RETURNED) else life)[finder, change.star] = change
    dead = {star for (_, star), change in life.items() if change.change is Change.DIED}
    moved = []
    for name in names:
        moves = [row for (_, star), row in place.items() if star == name and row.change is Change.MOVED]
        if moves and name not in dead:
            moved.append(_average(name, moves))
    number = max((int(name) for name in names if name.isdecimal()), default=-1) + 1
    added = []
    for group in _groups([light for _, light in lights]):
        if sum(light.sightings for light in group) >= min_sightings:
            added.append(_average(str(number), group))
            number += 1
    return Amendment(tuple(name for name in names if name in dead), tuple(moved), tuple(added))


def _is_one(first: SkyChange, second: SkyChange) -> bool:
    return abs(complex(first.x_m - second.x_m, first.y_m - second.y_m)) < SAME_LIGHT_M


def _groups(lights: Sequence[SkyChange]) -> list[list[SkyChange]]:
    """Findings of one light each, by several finders."""
    groups: list[list[SkyChange]] = []
    for light in lights:
        group = next((group for group in groups if _is_one(group[0], light)), None)
        if group is None:
            groups.append([light])
        else:
            group.append(light)
    return groups


def _average(name: str, found: Sequence[SkyChange]) -> NewPlace:
    """Combine places by their covariances."""
    information, weighted = np.zeros((2, 2)), np.zeros(2)
    for change in found:
        xx, xy, yy = change.covariance_m2
        weight = np.linalg.inv([[xx, xy], [xy, yy]])
        information += weight
        weighted += weight @ (change.x_m, change.y_m)
    covariance = np.linalg.inv(information)
    x, y = covariance @ weighted
    sigma_x, sigma_y = np.sqrt(np.diag(covariance))
    sightings = sum(change.sightings for change in found)
    return NewPlace(name, float(x), float(y), float(sigma_x), float(sigma_y), sightings)
