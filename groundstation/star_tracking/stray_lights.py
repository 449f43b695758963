"""Lights that are no star of the catalogue: which of them hang at one place of the ceiling.

A light that comes back at one place is followed. Its sightings and misses are summed as a log
likelihood ratio, "hangs there" against "was there by chance" (Wald's sequential test); after enough
sightings it is proposed, and proposed again each time that they have doubled, because its place is
better known then. A proposed light that is gone is reported to have vanished.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.sky_change import Change, Place, SkyChange

Complex = NDArray[np.complex128]

_MOST_FOLLOWED = 300
_FORGOTTEN_NATS = -4.0


@dataclass(frozen=True, slots=True)
class StraySettings:
    """When a light is proposed.

    Attributes:
        gate_m: Sightings this near to each other are of one light.
        sightings: It is proposed after so many.
        p_seen: How often a light that hangs there is seen.
        p_false: How often a light is seen there by chance.
        threshold_nats: Log-likelihood ratio that decides.
    """

    gate_m: float = 0.015
    sightings: int = 25
    p_seen: float = 0.9
    p_false: float = 0.02
    threshold_nats: float = 12.0


@dataclass(slots=True)
class _Stray:
    place: Place
    nats: float
    due_next: int  # sightings at which it is proposed (again)
    is_proposed: bool = False


class StrayLights:
    """Follows lights that are no stars.

    Args:
        settings: When a light is proposed.
    """

    def __init__(self, settings: StraySettings) -> None:
        self._settings = settings
        self._hit_nats = math.log(settings.p_seen / settings.p_false)
        self._miss_nats = math.log((1.0 - settings.p_seen) / (1.0 - settings.p_false))
        self._strays: list[_Stray] = []

    @property
    def places_m(self) -> Complex:
        """Where the followed lights hang, shape (k,), table."""
        return np.array([stray.place.mean for stray in self._strays], dtype=np.complex128)

    def note(
        self,
        lights: Complex,
        is_in_view: NDArray[np.bool_],
        systematic_m2: Callable[[], float],
    ) -> list[SkyChange]:
        """Learn from one picture; give what is newly found.

        Args:
            lights: Places of its lights that are no stars, shape (n,), table.
            is_in_view: Which of ``places_m`` the picture shows, shape (k,).
            systematic_m2: Variance per axis of a place that no averaging takes away.
        """
        settings, known = self._settings, len(self._strays)
        seen = np.zeros(known, dtype=bool)
        if known:
            distance = np.abs(lights[:, None] - self.places_m[None, :])
            for light, row in np.argwhere(distance < settings.gate_m).tolist():
                if not seen[row] and distance[light].argmin() == row:
                    seen[row] = True
                    self._strays[row].place.add(complex(lights[light]))
            lights = lights[(distance >= settings.gate_m).all(axis=1)]
            due = (seen | is_in_view).tolist()
        found: list[SkyChange] = []
        kept = []
        for row, stray in enumerate(self._strays):
            if due[row]:
                stray.nats += self._hit_nats if seen[row] else self._miss_nats
                stray.nats = min(stray.nats, 1.5 * settings.threshold_nats)
            if stray.nats < (-settings.threshold_nats if stray.is_proposed else _FORGOTTEN_NATS):
                if stray.is_proposed:
                    found.append(_say(Change.VANISHED, stray.place, systematic_m2()))
                continue
            kept.append(stray)
            if stray.place.sightings >= stray.due_next and stray.nats > settings.threshold_nats:
                stray.is_proposed = True
                stray.due_next *= 2
                found.append(_say(Change.APPEARED, stray.place, systematic_m2()))
        new = [_Stray(Place(complex(light)), self._hit_nats, settings.sightings) for light in lights]
        self._strays = (kept + new)[-_MOST_FOLLOWED:] if len(kept) + len(new) > _MOST_FOLLOWED else kept + new
        return found


def _say(change: Change, place: Place, systematic_m2: float) -> SkyChange:
    at = place.mean
    return SkyChange(change, "", at.real, at.imag, place.covariance_m2(systematic_m2), place.sightings)
