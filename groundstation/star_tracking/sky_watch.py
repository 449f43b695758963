"""A watchdog of the sky: which stars died, moved or appeared.

Every fix says which stars should be in the picture and which were seen. A star's sightings are a coin
with two sides, alive (seen with probability ``p_seen``) or dead (``p_false``); the log-likelihood ratio
of the two is summed with a forgetting factor and crosses a threshold either way (Wald's sequential
test). A star that is seen off its place by more than its noise allows has moved. A light that is no
star but keeps coming back at one place of the ceiling has appeared and is proposed.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from calibration.camera.models import CameraCalibration
from calibration.camera.star_catalogue import StarCatalogue
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import StarFix
from groundstation.star_tracking.rays import CeilingRays
from groundstation.star_tracking.sky_adjustment import project


class Change(StrEnum):
    """What happened to a star."""

    DIED = "died"
    REVIVED = "revived"
    MOVED = "moved"
    APPEARED = "appeared"


@dataclass(frozen=True, slots=True)
class SkyChange:
    """One finding.

    Attributes:
        change: What happened.
        star: Id of the catalogue; empty for a light that appeared.
        x_m: Where it is seen now (or was, if it died), table.
        y_m: Where it is seen now (or was, if it died), table.
        std_m: One sigma of that place per axis.
        sightings: How many sightings speak for it.
    """

    change: Change
    star: str
    x_m: float
    y_m: float
    std_m: float
    sightings: int


@dataclass(frozen=True, slots=True)
class SkyWatchSettings:
    """When something is called a change.

    Attributes:
        p_seen: How often a living star in the picture is seen.
        p_false: How often a dead one seems to be seen.
        threshold_nats: Log-likelihood ratio that decides.
        forget: Factor on old evidence per picture.
        margin_px: Stars nearer to the picture's edge are not counted.
        gate_m: A light this near to a star's place is that star.
        moved_m: A star is not called moved for less.
        moved_sigmas: Nor within so many sigmas.
        appear_sightings: A stray light is proposed after so many sightings in one place.
    """

    p_seen: float = 0.9
    p_false: float = 0.02
    threshold_nats: float = 12.0
    forget: float = 0.98
    margin_px: float = 12.0
    gate_m: float = 0.05
    moved_m: float = 2e-3
    moved_sigmas: float = 6.0
    appear_sightings: int = 25


@dataclass(slots=True)
class _Stray:
    """A light that is no star: running mean of its place."""

    place: complex
    sightings: int
    quiet: int


class SkyWatch:
    """Watches one ceiling through the fixes of any number of cameras of one kind.

    Args:
        catalogue: The stars.
        camera: The camera behind the fixes.
        settings: When something is called a change.
    """

    def __init__(
        self,
        catalogue: StarCatalogue,
        camera: CameraCalibration,
        settings: SkyWatchSettings | None = None,
    ) -> None:
        self._settings = settings or SkyWatchSettings()
        self._catalogue = catalogue
        self._camera = camera
        self._rays = CeilingRays(camera)
        self._star_m = np.stack((catalogue.x_m, catalogue.y_m), axis=1)
        self._star = catalogue.x_m + 1j * catalogue.y_m
        count = len(catalogue)
        self._dead_nats = np.zeros(count)
        self._is_dead = np.zeros(count, dtype=bool)
        self._has_moved = np.zeros(count, dtype=bool)
        self._missed = np.zeros(count, dtype=np.int64)
        self._weight = np.zeros(count)
        self._offset = np.zeros(count, dtype=np.complex128)
        self._square = np.zeros(count)
        self._strays: list[_Stray] = []

    @property
    def dead(self) -> NDArray[np.int64]:
        """Rows of the catalogue that are called dead."""
        return np.flatnonzero(self._is_dead)

    def note(self, fix: StarFix, spots: Spots) -> list[SkyChange]:
        """Learn from one fix and its spots; give what is newly found."""
        points = self._rays.look_up(spots.u_px, spots.v_px)
        where = np.exp(1j * fix.heading_rad) * points.q_body_m + complex(fix.x_m, fix.y_m)
        distance = np.abs(where[:, None] - self._star[None, :])
        nearest = distance.argmin(axis=1) if len(where) else np.zeros(0, np.int64)
        off = distance[np.arange(len(where)), nearest]
        mine = off < self._settings.gate_m
        changes = self._watch_life(fix, nearest[mine])
        changes += self._watch_places(where[mine], nearest[mine])
        return changes + self._watch_strays(where[~mine])

    def _watch_life(self, fix: StarFix, seen: NDArray[np.int64]) -> list[SkyChange]:
        settings = self._settings
        due = self._due(fix)
        was_seen = np.zeros(len(self._star), dtype=bool)
        was_seen[seen] = True
        nats_miss = math.log((1.0 - settings.p_false) / (1.0 - settings.p_seen))
        nats_hit = math.log(settings.p_false / settings.p_seen)
        self._dead_nats[due] *= settings.forget
        self._dead_nats[due] += np.where(was_seen[due], nats_hit, nats_miss)
        limit = 1.5 * settings.threshold_nats  # so that a long life does not hide a death
        np.clip(self._dead_nats, -limit, limit, out=self._dead_nats)
        self._missed[due & ~was_seen] += 1
        self._missed[was_seen] = 0
        died = due & ~self._is_dead & (self._dead_nats > settings.threshold_nats)
        revived = due & self._is_dead & (self._dead_nats < -settings.threshold_nats)
        self._is_dead = (self._is_dead | died) & ~revived
        found = [self._change(Change.DIED, int(i), int(self._missed[i])) for i in np.flatnonzero(died)]
        return found + [self._change(Change.REVIVED, int(i), 0) for i in np.flatnonzero(revived)]

    def _watch_places(self, where: NDArray[np.complex128], star: NDArray[np.int64]) -> list[SkyChange]:
        settings = self._settings
        error = where - self._star[star]
        self._weight[star] = settings.forget * self._weight[star] + 1.0
        share = 1.0 / self._weight[star]
        before = self._offset[star]
        self._offset[star] = before + share * (error - before)
        self._square[star] += share * (np.abs(error - before) ** 2 - self._square[star])
        found = []
        for row in np.unique(star):
            weight = float(self._weight[row])
            shift = complex(self._offset[row])
            std = math.sqrt(0.5 * float(self._square[row]) / max(weight, 1.0))
            far = weight > 10.0 and abs(shift) > max(settings.moved_m, settings.moved_sigmas * std)
            if far and not self._has_moved[row]:
                place = complex(self._star[row]) + shift
                name = self._catalogue.ids[int(row)]
                found.append(SkyChange(Change.MOVED, name, place.real, place.imag, std, int(weight)))
            self._has_moved[row] = far
        return found

    def _watch_strays(self, where: NDArray[np.complex128]) -> list[SkyChange]:
        settings = self._settings
        found = []
        for stray in self._strays:
            stray.quiet += 1
        for place in where:
            near = [stray for stray in self._strays if abs(stray.place - place) < 0.3 * settings.gate_m]
            if not near:
                self._strays.append(_Stray(complex(place), 1, 0))
                continue
            stray = near[0]
            stray.sightings += 1
            stray.quiet = 0
            stray.place += (complex(place) - stray.place) / stray.sightings
            if stray.sightings == settings.appear_sightings:
                std = self._rays.scale_m_px * 0.1
                found.append(
                    SkyChange(Change.APPEARED, "", stray.place.real, stray.place.imag, std, stray.sightings)
                )
        self._strays = [s for s in self._strays if s.quiet < 20 * s.sightings]
        return found

    def _due(self, fix: StarFix) -> NDArray[np.bool_]:
        """Tell which stars should be inside the picture."""
        pose = np.array([[fix.x_m, fix.y_m, fix.heading_rad]])
        near = np.abs(self._star - complex(fix.x_m, fix.y_m)) < self._rays.reach_m
        due = np.zeros(len(self._star), dtype=bool)
        rows = np.flatnonzero(near)
        if len(rows) == 0:
            return due
        pixel, _ = project(self._camera, np.repeat(pose, len(rows), axis=0), self._star_m[rows])
        margin = self._settings.margin_px
        size = np.array([self._camera.width - 1.0, self._camera.height - 1.0])
        due[rows] = ((pixel > margin) & (pixel < size - margin)).all(axis=1)
        return due

    def _change(self, change: Change, row: int, sightings: int) -> SkyChange:
        x, y = self._star_m[row]
        std = float(self._catalogue.std_m[row])
        return SkyChange(change, self._catalogue.ids[row], float(x), float(y), std, sightings)
