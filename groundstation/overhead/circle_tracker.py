"""The overhead alternative: a camera over the table finds mock-ups by three coloured circles each.

Triples of circles that fit a mock-up's pattern, the right way round, give its pose by weighted least squares,
with covariance; several mock-ups are told apart by their patterns, and no circle serves two. What is not
found comes with a reason.
"""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.frames import rigid_fit
from groundstation.overhead.circles import (
    ColourSettings,
    PlaneView,
    SeenCircle,
    find_circles,
)
from groundstation.overhead.liveries import Livery, check_distinct
from groundstation.overhead.overhead_camera import OverheadCamera

Array = NDArray[np.float64]

SIDE_TOLERANCE_M = 0.008
"""Sides of a pattern may be off by so much: half of what tells two patterns apart."""
PATTERN_SIGMA_M = 0.0007
"""How well circles are glued, per axis; the fix's floor in the rig accounts for it, this is for the gate."""
GATE_CHI2 = 21.1
"""Of three degrees of freedom: six numbers seen, three found; exceeded by chance once in 10,000."""
TWIN_CHI2 = 12.0
"""Two places that fit: the better one must be better by this much (a factor of 400 in likelihood)."""


@dataclass(frozen=True, slots=True, eq=False)
class OverheadFix:
    """Pose of one mock-up in the table at the middle of the exposure.

    Attributes:
        vehicle: Its name.
        x_m: Body origin.
        y_m: Body origin.
        heading_rad: In (-pi, pi].
        covariance: Covariance (3, 3) of x, y, heading; m^2, m rad, rad^2.
        misfit_m: RMS distance between circles and pattern.
        circles: How many were used.
        whole: How many of them were seen whole.
    """

    vehicle: str
    x_m: float
    y_m: float
    heading_rad: float
    covariance: Array
    misfit_m: float
    circles: int
    whole: int


@dataclass(frozen=True, slots=True)
class NoOverheadFix:
    """Why a mock-up was not found."""

    vehicle: str
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class _Candidate:
    """A triple of circles that fits a pattern."""

    fix: OverheadFix
    chi2: float
    used: tuple[int, ...]


class OverheadTracker:
    """Finds the mock-ups in each picture on its own.

    Args:
        camera: The overhead camera.
        liveries: The circles of the mock-ups that may be there.
        settings: What counts as a coloured circle.

    Raises:
        ValueError: Two mock-ups cannot be told apart.
    """

    def __init__(
        self, camera: OverheadCamera, liveries: Sequence[Livery], settings: ColourSettings | None = None
    ) -> None:
        check_distinct(liveries)
        self._camera, self._liveries = camera, tuple(liveries)
        self._view = PlaneView(camera)
        self._settings = settings or ColourSettings()

    def look(self, image: NDArray[np.uint8]) -> list[OverheadFix | NoOverheadFix]:
        """Find the mock-ups in a picture; one answer per livery, in their order.

        Args:
            image: Picture (h, w, 3) of the camera's size, uint8, blue-green-red.

        Raises:
            ValueError: The picture is not 8-bit colour, or of another size.
        """
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise ValueError(f"expected an 8-bit colour picture, found {image.dtype} of shape {image.shape}")
        size = (self._camera.height, self._camera.width)
        if image.shape[:2] != size:
            raise ValueError(
                f"the picture is {image.shape[1]} x {image.shape[0]} px, the camera's file says "
                f"{size[1]} x {size[0]}"
            )
        sizes = {(livery.height_table_m, livery.radius_m) for livery in self._liveries}
        circles = {
            each: find_circles(image, self._view, *each, settings=self._settings) for each in sorted(sizes)
        }
        candidates: list[tuple[Livery, _Candidate]] = []
        for livery in self._liveries:
            seen = circles[livery.height_table_m, livery.radius_m]
            candidates += [(livery, candidate) for candidate in candidates_of(livery, seen)]
        taken = _assign(candidates)
        return [
            taken[livery.vehicle]
            if livery.vehicle in taken
            else NoOverheadFix(
                livery.vehicle, _reason(livery, circles[livery.height_table_m, livery.radius_m])
            )
            for livery in self._liveries
        ]


def candidates_of(livery: Livery, seen: Sequence[SeenCircle]) -> list[_Candidate]:
    """Give every triple of circles that fits a livery, best first."""
    body = np.array([complex(circle.x_body_m, circle.y_body_m) for circle in livery.circles])
    choices = [[i for i, one in enumerate(seen) if one.colour == circle.colour] for circle in livery.circles]
    found = []
    sides = np.abs(body - np.roll(body, -1))
    for i, j in itertools.product(choices[0], choices[1]):
        if i == j or abs(abs(seen[i].place_m - seen[j].place_m) - sides[0]) > SIDE_TOLERANCE_M:
            continue
        for k in choices[2]:
            if k in (i, j) or abs(abs(seen[j].place_m - seen[k].place_m) - sides[1]) > SIDE_TOLERANCE_M:
                continue
            if abs(abs(seen[k].place_m - seen[i].place_m) - sides[2]) > SIDE_TOLERANCE_M:
                continue
            candidate = _fit(livery, body, [seen[n] for n in (i, j, k)], (i, j, k))
            if candidate.chi2 < GATE_CHI2:  # the mirror image has the same sides and a large misfit
                found.append(candidate)
    return sorted(found, key=lambda candidate: candidate.chi2)


def _fit(
    livery: Livery, body: NDArray[np.complex128], circles: Sequence[SeenCircle], used: tuple[int, ...]
) -> _Candidate:
    """Weighted least squares of x, y, heading."""
    place = np.array([circle.place_m for circle in circles])
    turn, shift = rigid_fit(body, place)
    x = np.array([shift.real, shift.imag, float(np.angle(turn))])
    own = [np.linalg.inv(circle.covariance_m2) for circle in circles]
    for _ in range(2):
        arm = body * np.exp(1j * x[2])
        residual = place - (complex(x[0], x[1]) + arm)
        information, gradient = np.zeros((3, 3)), np.zeros(3)
        for a, r, weight in zip(arm, residual, own, strict=True):
            lever = np.array([[1.0, 0.0, -a.imag], [0.0, 1.0, a.real]])
            information += lever.T @ weight @ lever
            gradient += lever.T @ weight @ (r.real, r.imag)
        covariance = np.linalg.inv(information)
        x = x + covariance @ gradient
    residual = place - (complex(x[0], x[1]) + body * np.exp(1j * x[2]))
    glue = np.eye(2) * PATTERN_SIGMA_M**2
    chi2 = sum(
        float((r.real, r.imag) @ np.linalg.inv(circle.covariance_m2 + glue) @ (r.real, r.imag))
        for r, circle in zip(residual, circles, strict=True)
    )
    fix = OverheadFix(
        livery.vehicle,
        float(x[0]),
        float(x[1]),
        float(np.angle(np.exp(1j * x[2]))),
        np.asarray(covariance),
        float(np.sqrt((np.abs(residual) ** 2).mean())),
        len(circles),
        sum(circle.is_whole for circle in circles),
    )
    return _Candidate(fix, chi2, used)


def _assign(
    candidates: Iterable[tuple[Livery, _Candidate]],
) -> dict[str, OverheadFix | NoOverheadFix]:
    """Give each mock-up its best triple, each circle to one mock-up; two triples as good are none."""
    taken: dict[str, OverheadFix | NoOverheadFix] = {}
    chi2_of: dict[str, float] = {}
    used: set[tuple[tuple[float, float], int]] = set()
    for livery, candidate in sorted(candidates, key=lambda each: each[1].chi2):
        plane = (livery.height_table_m, livery.radius_m)
        mine = {(plane, number) for number in candidate.used}
        if livery.vehicle in taken:
            is_twin = not mine & used and candidate.chi2 - chi2_of[livery.vehicle] < TWIN_CHI2
            if is_twin:
                taken[livery.vehicle] = NoOverheadFix(livery.vehicle, "its circles are seen at two places")
            continue
        if mine & used:
            continue
        taken[livery.vehicle] = candidate.fix
        chi2_of[livery.vehicle] = candidate.chi2
        used |= mine
    return taken


def _reason(livery: Livery, seen: Sequence[SeenCircle]) -> str:
    missing = [
        colour
        for colour in dict.fromkeys(circle.colour for circle in livery.circles)
        if not any(one.colour == colour for one in seen)
    ]
    if not seen:
        return "no coloured circle in the picture"
    if missing:
        return f"no {' and no '.join(missing)} circle in the picture"
    return "no three circles make its pattern"
