"""What the fault detector judges, and what it leaves alone while the vehicle stands on the glass."""

import math
from pathlib import Path

import pytest

from groundstation.parts.fusion.messages import FusionStatus
from groundstation.parts.imu.messages import Imu
from groundstation.parts.supervision.fault_detector import DISTURBED_NS, FLOATING_NS, FaultDetector
from groundstation.parts.supervision.messages import Findings, Supervision
from groundstation.parts.supervision.part import PART
from groundstation.parts.valves.messages import ValveStatus
from groundstation.rig.read import load_rig

EXAMPLE = Path(__file__).parents[5] / "examples/rigs/two_mock_ups.toml"
PERIOD_NS = 10_000_000


class Flight:
    """Messages of a vehicle that rested and floats, ten milliseconds apart."""

    def __init__(self) -> None:
        (row,) = (row for row in PART.nodes if row.name == "fault_detector")
        self.detector: FaultDetector = row.make(load_rig(EXAMPLE), "alpha")
        self.now_ns, self.ticks, self.found = 0, 0, set()
        self._give(
            Supervision(
                0, "alpha", "flying", "controller", True, True, False, 0.0, True, 0, "", "", 0, (), ()
            )
        )

    def _give(self, message) -> None:
        for answer in self.detector.receive(message, self.now_ns):
            if isinstance(answer, Findings):
                self.found.update(answer.ids)

    def fly(self, seconds: float, *, floats: bool | None, zero_rad_s: float = 0.0) -> set[str]:
        """So long; `floats` is what the valve node reports, None where no report comes."""
        for _ in range(round(seconds * 1e9 / PERIOD_NS)):
            self.now_ns += PERIOD_NS
            self.ticks += 10
            if floats is not None:
                self._give(ValveStatus(self.now_ns, "alpha", 0, 0, True, False, floats, 2e5, 0, 50.0))
            self._give(FusionStatus(
                self.now_ns, "alpha", "ready", "", zero_rad_s, (0.0, 0.0), 8.0, 10, 0, 0.1, (0.0, 0.0)
            ))  # fmt: skip
            self._give(Imu(
                self.now_ns, "alpha", self.ticks, 10, 0.01, 1e-4, 0.0, (0.0, 0.0), 25.0, True, "", 0, 7
            ))  # fmt: skip
            for answer in self.detector.tick(self.now_ns):
                if isinstance(answer, Findings):
                    self.found.update(answer.ids)
        return self.found


def test_a_zero_that_moves_in_flight_is_a_fault():
    flight = Flight()
    assert "imu_shifted" not in flight.fly(4.0, floats=True)
    assert "imu_shifted" in flight.fly(0.5, floats=True, zero_rad_s=math.radians(1.0))


@pytest.mark.parametrize("floats", [None, False], ids=["no report", "the air is off"])
def test_nothing_of_the_gyro_is_judged_where_no_report_says_that_it_floats(floats):
    # a supervisor that is paused publishes no landing; the node cuts the air, a new rest gives new zeros
    flight = Flight()
    flight.fly(4.0, floats=True)
    flight.fly(FLOATING_NS * 1e-9 + 0.1, floats=floats)
    assert "imu_shifted" not in flight.fly(10.0, floats=floats, zero_rad_s=math.radians(1.0))
    # when it floats again it is not judged by what was before
    flight.fly(DISTURBED_NS * 1e-9 + 4.0, floats=True, zero_rad_s=math.radians(1.0))
    assert "imu_shifted" not in flight.found
    assert "imu_shifted" in flight.fly(0.5, floats=True, zero_rad_s=math.radians(2.0))
