"""What the watchdog of the sky finds, and how well a place is known that was seen many times."""

from dataclasses import dataclass
from enum import StrEnum


class Change(StrEnum):
    """What happened to a star."""

    DIED = "died"
    REVIVED = "revived"
    MOVED = "moved"
    RETURNED = "returned"
    APPEARED = "appeared"
    VANISHED = "vanished"


@dataclass(frozen=True, slots=True)
class SkyChange:
    """One finding.

    Attributes:
        change: What happened.
        star: Id of the catalogue; empty for a light that is none of its stars.
        x_m: Where it is seen now (or was last), table.
        y_m: Where it is seen now (or was last), table.
        covariance_m2: Covariance of that place: xx, xy, yy.
        sightings: How many sightings (of a dead star: misses) speak for it.
    """

    change: Change
    star: str
    x_m: float
    y_m: float
    covariance_m2: tuple[float, float, float]
    sightings: int


@dataclass(slots=True)
class Place:
    """Running mean and scatter of the sightings of one light, table coordinates (Welford)."""

    mean: complex
    sightings: int = 1
    _xx: float = 0.0
    _xy: float = 0.0
    _yy: float = 0.0

    def add(self, where: complex) -> None:
        """Take one sighting."""
        self.sightings += 1
        before = where - self.mean
        self.mean += before / self.sightings
        after = where - self.mean
        self._xx += before.real * after.real
        self._xy += 0.5 * (before.real * after.imag + before.imag * after.real)
        self._yy += before.imag * after.imag

    def covariance_m2(self, systematic_m2: float) -> tuple[float, float, float]:
        """Covariance of the mean: what sightings scatter, averaged, plus what does not average out."""
        count = max(self.sightings * (self.sightings - 1), 1)
        return self._xx / count + systematic_m2, self._xy / count, self._yy / count + systematic_m2
