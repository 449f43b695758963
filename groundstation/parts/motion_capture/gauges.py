"""What is shown of motion capture: the rate of its poses, and why there are none."""

from groundstation.declarations.view import NOTHING, Cell, Gauge, GaugeRow, Level, Newest, cell
from groundstation.parts.motion_capture.messages import CaptureFix


class CaptureGauge(Gauge):
    """Rate and last refusal."""

    label = "motion capture"
    newest = (CaptureFix,)
    rated = (CaptureFix,)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        fix = newest.get(CaptureFix)
        if fix is None:
            return NOTHING
        rate = cell(f"{newest.rate_hz(CaptureFix, now_ns):5.0f} /s")
        return rate if fix.fix else rate + cell(f"  {fix.reason}", Level.BAD)


GAUGES = (GaugeRow(85, CaptureGauge),)
