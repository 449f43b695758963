"""What people are shown of the range finder."""

from groundstation.declarations.view import NOTHING, Cell, Gauge, GaugeRow, Level, Newest, cell
from range_finder.messages import Range


class RangeGauge(Gauge):
    """Distance, rate and losses."""

    label = "range ahead"
    newest = (Range,)
    rated = (Range,)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        found = newest.get(Range)
        if found is None:
            return NOTHING
        distance = f"{found.distance_m:8.3f} m" if found.has_echo else "no echo"
        shown = cell(distance, Level.PLAIN if found.has_echo else Level.WARNING)
        rate_hz = newest.rate_hz(Range, now_ns)
        shown += cell(f"  {rate_hz:3.0f} /s", Level.PLAIN if rate_hz else Level.BAD)
        return shown + cell(f"  {found.lines_lost} lost", Level.WARNING if found.lines_lost else Level.FAINT)


GAUGES = (GaugeRow(85, RangeGauge),)
