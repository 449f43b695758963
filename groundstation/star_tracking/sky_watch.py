"""A watchdog of the sky: which stars died, moved or came back, and which lights are new.

Every fix states which stars should be in the picture and which were seen. A star's sightings are a coin
with two sides, alive (seen with probability ``p_seen``) or dead (``p_false``); the log-likelihood ratio
of the two is summed with a forgetting factor and crosses a threshold either way (Wald's sequential
test). A star that is seen off its place again and again, always at the same other place, has moved.
Lights that are no stars are followed by ``stray_lights``.

What is dead or has moved is given by ``dropped``; both may come back. A fix of few stars teaches nothing.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.rays import CeilingRays, spot_covariance
from groundstation.star_tracking.sky_change import Change, Place, SkyChange
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.stray_lights import StrayLights, StraySettings
from groundstation.star_tracking.view_outline import ViewOutline

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]

_NEIGHBOUR_SHARE = 0.4  # of the distance to the next star: a light farther off may be either's
_SETTLED_SIGHTINGS = 10.0
_CENTRE_FLOOR_PX = 0.01


@dataclass(frozen=True, slots=True)
class SkyWatchSettings:
    """When something is called a change.

    Attributes:
        p_seen: How often a living star in the picture is seen.
        p_false: How often a dead one seems to be seen.
        threshold_nats: Log-likelihood ratio that decides.
        forget: Factor on old evidence per picture.
        margin_px: Stars nearer to the picture's edge are not counted.
        gate_m: A light this near to a star's place is that star; less where stars hang closer.
        moved_m: A star is not called moved for less.
        moved_sigmas: Nor within so many sigmas of a sighting.
        moved_sightings: Nor after fewer sightings at its new place.
        min_stars: Fixes of fewer stars teach nothing.
        strays: When a light that is no star is proposed.
    """

    p_seen: float = 0.9
    p_false: float = 0.02
    threshold_nats: float = 12.0
    forget: float = 0.98
    margin_px: float = 12.0
    gate_m: float = 0.05
    moved_m: float = 2e-3
    moved_sigmas: float = 6.0
    moved_sightings: int = 12
    min_stars: int = 5
    strays: StraySettings = field(default_factory=StraySettings)


class SkyWatch:
    """Watches one ceiling through the fixes of one camera.

    Args:
        catalogue: The stars.
        camera: The camera behind the fixes.
        settings: When something is called a change.
        rays: The camera's table, where there is one already.
    """

    def __init__(
        self,
        catalogue: StarCatalogue,
        camera: CameraCalibration,
        settings: SkyWatchSettings | None = None,
        rays: CeilingRays | None = None,
    ) -> None:
        self._settings = settings or SkyWatchSettings()
        self._catalogue = catalogue
        self._rays = rays or CeilingRays(camera)
        self._view = ViewOutline(camera, self._settings.margin_px)
        self._hit_nats = math.log(self._settings.p_false / self._settings.p_seen)
        self._miss_nats = math.log((1.0 - self._settings.p_false) / (1.0 - self._settings.p_seen))
        self._star_m = np.stack((catalogue.x_m, catalogue.y_m), axis=1)
        self._star = catalogue.x_m + 1j * catalogue.y_m
        self._tree = cKDTree(self._star_m)
        apart = np.asarray(self._tree.query(self._star_m, k=2)[0])[:, 1]
        self._gate_m = np.minimum(self._settings.gate_m, _NEIGHBOUR_SHARE * apart)
        count = len(catalogue)
        self._dead_nats = np.zeros(count)
        self._is_dead = np.zeros(count, dtype=bool)
        self._missed = np.zeros(count, dtype=np.int64)
        self._elsewhere: dict[int, Place] = {}  # stars seen off their place
        self._moved: dict[int, complex] = {}  # stars that are called moved, and the place that was told
        self._home = np.zeros(count, dtype=np.int64)  # sightings of a moved star at its old place
        self._weight = np.zeros(count)
        self._offset = np.zeros(count, dtype=np.complex128)
        self._square = np.zeros(count)
        self._strays = StrayLights(self._settings.strays)

    @property
    def dead(self) -> Index:
        """Rows of the catalogue that are called dead."""
        return np.flatnonzero(self._is_dead)

    @property
    def dropped(self) -> Index:
        """Rows of the catalogue that no fix should rest on: dead, or not where they should be."""
        rows = self._is_dead.copy()
        rows[list(self._moved)] = True
        return np.flatnonzero(rows)

    def note(self, fix: PictureFix, spots: Spots) -> list[SkyChange]:
        """Learn from one fix and its spots; give what is newly found."""
        if fix.stars < self._settings.min_stars or len(spots) == 0:
            return []
        points = self._rays.look_up(spots.u_px, spots.v_px)
        turn = np.exp(1j * fix.heading_rad)
        where = turn * points.q_body_m + complex(fix.x_m, fix.y_m)
        nearest = np.full(len(where), -1, dtype=np.int64)
        nearest[fix.spot_index] = fix.star_index
        # A star within the gate is the nearest one, so that only the other spots have to be looked for.
        mine = np.abs(where - self._star[nearest]) < self._gate_m[nearest]
        others = np.flatnonzero(~mine | (nearest < 0))
        if len(others):
            off, star = self._tree.query(where[others].view(np.float64).reshape(-1, 2))
            nearest[others] = star
            mine[others] = np.asarray(off) < self._gate_m[nearest[others]]
        covariance = spot_covariance(points, spots.covariance_px2)
        arm2 = np.abs(points.q_body_m) ** 2
        variance = (
            0.5 * (covariance[:, 0, 0] + covariance[:, 1, 1] + fix.covariance[0, 0] + fix.covariance[1, 1])
            + arm2 * fix.covariance[2, 2]
        )
        star = nearest[mine]
        shown = self._shows(fix, np.concatenate((self._star, self._strays.places_m)))
        count = len(self._star)
        changes = self._watch_life(shown[:count], star)
        changes += self._watch_places(where[mine], star, np.sqrt(variance[mine]))
        return changes + self._strays.note(where[~mine], shown[count:], self._systematic_m2)

    def _watch_life(self, due: NDArray[np.bool_], seen: Index) -> list[SkyChange]:
        settings = self._settings
        was_seen = np.zeros(len(self._star), dtype=bool)
        was_seen[seen] = True
        nats = settings.forget * self._dead_nats + np.where(was_seen, self._hit_nats, self._miss_nats)
        limit = 1.5 * settings.threshold_nats  # so that a long life does not hide a death
        nats = np.minimum(np.maximum(nats, -limit), limit)
        self._dead_nats = np.where(due, nats, self._dead_nats)
        self._missed += due
        self._missed[was_seen] = 0
        died = due & ~self._is_dead & (self._dead_nats > settings.threshold_nats)
        revived = due & self._is_dead & (self._dead_nats < -settings.threshold_nats)
        self._is_dead = (self._is_dead | died) & ~revived
        found = [self._at_home(Change.DIED, int(i), int(self._missed[i])) for i in np.flatnonzero(died)]
        return found + [self._at_home(Change.REVIVED, int(i), 0) for i in np.flatnonzero(revived)]

    def _watch_places(self, where: Complex, star: Index, sigma_m: NDArray[np.float64]) -> list[SkyChange]:
        settings = self._settings
        error = where - self._star[star]
        sigma = np.hypot(sigma_m, self._catalogue.sigma_m[star])
        limit = np.maximum(settings.moved_m, settings.moved_sigmas * sigma)
        is_off = np.abs(error) > limit
        at_home = star
        if is_off.any():
            at_home, error = star[~is_off], error[~is_off]
        self._average(at_home, error)
        found = []
        for row in at_home.tolist() if self._elsewhere or self._moved else ():
            if row in self._elsewhere:
                del self._elsewhere[row]
            if row in self._moved:
                self._home[row] += 1
                if self._home[row] >= settings.moved_sightings:
                    del self._moved[row]
                    found.append(self._at_home(Change.RETURNED, row, int(self._home[row])))
        for row, at, gate in zip(star[is_off].tolist(), where[is_off], limit[is_off], strict=True):
            self._home[row] = 0
            place = self._elsewhere.get(row)
            if place is None or abs(place.mean - at) > gate:
                self._elsewhere[row] = Place(complex(at))
                continue
            place.add(complex(at))
            given = self._moved.get(row)
            is_news = given is None or abs(place.mean - given) > gate
            if is_news and place.sightings >= settings.moved_sightings:
                self._moved[row] = place.mean
                name, covariance = self._catalogue.ids[row], place.covariance_m2(self._systematic_m2())
                found.append(
                    SkyChange(
                        Change.MOVED, name, place.mean.real, place.mean.imag, covariance, place.sightings
                    )
                )
        return found

    def _average(self, star: Index, error: Complex) -> None:
        """Keep each star's mean offset and its scatter, old sightings forgotten."""
        self._weight[star] = self._settings.forget * self._weight[star] + 1.0
        share = 1.0 / self._weight[star]
        before = self._offset[star]
        self._offset[star] = before + share * (error - before)
        self._square[star] += share * (np.abs(error - before) ** 2 - self._square[star])

    def _systematic_m2(self) -> float:
        """Variance per axis of a mean place that no averaging takes away.

        It is what the stars' own mean offsets scatter beyond their noise: lens, catalogue, level.
        """
        floor = (_CENTRE_FLOOR_PX * self._rays.scale_m_px) ** 2
        known = self._weight > _SETTLED_SIGHTINGS
        if int(known.sum()) < self._settings.min_stars:
            return floor + float(np.median(self._catalogue.sigma_m)) ** 2
        spread = 0.5 * float(np.mean(np.abs(self._offset[known]) ** 2))
        noise = 0.5 * float(np.mean(self._square[known] / self._weight[known]))
        return floor + max(spread - noise, 0.0)

    def _shows(self, fix: PictureFix, places: Complex) -> NDArray[np.bool_]:
        """Tell which places of the ceiling lie well inside the picture."""
        turn_back = complex(math.cos(fix.heading_rad), -math.sin(fix.heading_rad))
        return self._view.shows(turn_back * (places - complex(fix.x_m, fix.y_m)))

    def _at_home(self, change: Change, row: int, sightings: int) -> SkyChange:
        x, y = self._star_m[row]
        variance = float(self._catalogue.sigma_m[row]) ** 2
        return SkyChange(
            change, self._catalogue.ids[row], float(x), float(y), (variance, 0.0, variance), sightings
        )
