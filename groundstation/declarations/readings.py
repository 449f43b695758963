"""Numbers as gauges show them: errors of the last seconds, counts by reason, columns of fixed width."""

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from groundstation.declarations.view import NOTHING, Cell, Level, cell
from groundstation.frames import wrap_angle

ERROR_WINDOW_S = 30
_SECOND_NS = 1_000_000_000


@dataclass(slots=True)
class _Second:
    """Sums over one second of comparisons."""

    number: int
    count: int = 0
    position_m2: float = 0.0
    heading_rad2: float = 0.0


@dataclass(slots=True)
class RecentErrors:
    """Distances between two poses over the last ``ERROR_WINDOW_S``, summed per second."""

    _seconds: deque[_Second] = field(default_factory=deque)

    def add(self, now_ns: int, position_m: float, heading_rad: float) -> None:
        """Take one comparison."""
        number = now_ns // _SECOND_NS
        seconds = self._seconds
        if not seconds or seconds[-1].number != number:
            seconds.append(_Second(number))
            while number - seconds[0].number > ERROR_WINDOW_S:
                seconds.popleft()
        newest = seconds[-1]
        newest.count += 1
        newest.position_m2 += position_m * position_m
        newest.heading_rad2 += heading_rad * heading_rad

    def rms(self) -> tuple[float, float]:
        """RMS of position (m) and heading (rad); NaN when empty."""
        count = sum(second.count for second in self._seconds)
        if not count:
            return math.nan, math.nan
        position_m2 = sum(second.position_m2 for second in self._seconds)
        heading_rad2 = sum(second.heading_rad2 for second in self._seconds)
        return math.sqrt(position_m2 / count), math.sqrt(heading_rad2 / count)


def distance(
    from_m: Iterable[float], from_heading_rad: float, to_m: Iterable[float], to_heading_rad: float
) -> tuple[float, float]:
    """Distance (m) and turn in [-pi, pi) (rad) from one pose to another."""
    return math.dist(tuple(from_m), tuple(to_m)), wrap_angle(to_heading_rad - from_heading_rad)


def pose_cell(position_m: float, heading_rad: float, level: Level = Level.PLAIN) -> Cell:
    """A distance in mm and an angle in degrees; a dash while there is none."""
    if math.isnan(position_m):
        return NOTHING
    return cell(f"{position_m * 1e3:8.2f} mm {math.degrees(heading_rad):8.3f} deg", level)


def counts_cell(by_reason: Mapping[str, int]) -> Cell:
    """Counts by reason, the most frequent first."""
    counts = sorted(by_reason.items(), key=lambda item: -item[1])
    return cell(", ".join(f"{count} x {reason}" for reason, count in counts), Level.FAINT)


def column(value: float, width: int, digits: int) -> str:
    """A number of fixed width; a dash while there is none."""
    return f"{value:{width}.{digits}f}" if math.isfinite(value) else f"{'-':>{width}}"
