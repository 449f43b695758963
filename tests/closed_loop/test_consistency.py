"""The consistency checks beside flights of the emulator, fed from messages as a node would feed them."""

import math

import pytest

from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.declarations.node import Node
from groundstation.parts.fusion.messages import FixAccount, FusionStatus
from groundstation.parts.imu.messages import Imu
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.valves.messages import ValveCommand, ValveStatus
from groundstation.supervision.imu_consistency import ImuConsistency, ImuConsistencyConfig
from groundstation.supervision.thrust_fit import FitConfig
from groundstation.supervision.valve_consistency import ValveConsistency, ValveConsistencyConfig

FAULT_S = 12.0
FLOATS_FOR_SURE_NS = 500_000_000
QUICK_FIXES = (("rate_hz = 1.5", "rate_hz = 15.0"), ("delay_s = 0.6", "delay_s = 0.02"))


class Watcher(Node):
    """Feeds both checks; notes when which finding came, and what each valve was commanded since the fault."""

    inputs = (Imu, ValveCommand, ValveStatus, FusionStatus, FixAccount, StarFix)
    outputs = ()

    def __init__(self):
        super().__init__("alpha", 1_000_000_000)
        fit = FitConfig(
            imu_position_body_m=(0.03151, -0.02122),
            gyro_density_rad_s_rthz=6.7e-5,
            acc_density_m_s2_rthz=6.5e-5,
        )
        model = VehicleModel(11.0, 0.25, square_of_eight())
        self.valves = ValveConsistency(model, ValveConsistencyConfig(fit=fit))
        self.imu = ImuConsistency(
            ImuConsistencyConfig(gyro_density_rad_s_rthz=6.7e-5, heading_sigma_rad=math.radians(0.05))
        )
        self.found = {}
        self.on_ms = [0] * 8
        self._zeros = None
        self._floats_since_ns = None
        self._pulse_id = None

    def receive(self, message, now_ns):
        match message:
            case ValveCommand():
                self.valves.command(now_ns, message.pulse_id, message.on_time_ms)
                if message.pulse_id != self._pulse_id and now_ns >= FAULT_S * 1e9 and not self.found:
                    self.on_ms = [sum(each) for each in zip(self.on_ms, message.on_time_ms, strict=True)]
                self._pulse_id = message.pulse_id
            case FusionStatus():
                self._zeros = message
                if self._flies(now_ns):
                    self.imu.zero(now_ns, message.bias_rate_rad_s)
            case ValveStatus():
                if not message.floating:
                    self._floats_since_ns = None
                elif self._floats_since_ns is None and self._zeros is not None:
                    self._floats_since_ns = now_ns
                    self.valves.start(self._zeros.bias_force_m_s2)
            case Imu() if self._flies(now_ns) and message.valid:
                rate = message.rate_body_rad_s - self._zeros.bias_rate_rad_s
                self.imu.sample(message.stamp_ns, rate)
                self.valves.sample(message.stamp_ns, message.window_s, rate, message.force_body_m_s2)
            case StarFix() if message.fix:
                self.imu.fix("stars", message.stamp_ns, message.heading_rad)
            case FixAccount() if self._flies(now_ns):
                self.imu.account(
                    message.source,
                    used=message.used,
                    reason=message.reason,
                    innovation=message.innovation,
                    nis=message.nis,
                )
        for finding in self.valves.findings(now_ns) + self.imu.findings:
            self.found.setdefault(finding.id, (now_ns * 1e-9, finding.detail))
        return iter(())

    def _flies(self, now_ns):
        since = self._floats_since_ns
        return since is not None and now_ns - since > FLOATS_FOR_SURE_NS


def watched(fly, kind, seconds, seed=1, changes=(), **parameters):
    watcher = Watcher()
    inner = ", ".join(f"{name} = {float(value)}" for name, value in parameters.items())
    fault = (
        f'\n[[laboratory.faults]]\nkind = "{kind}"\nvehicle = "alpha"\n'
        f"start_s = {FAULT_S}\nparameters = {{ {inner} }}\n"
        if kind
        else ""
    )
    fly(fault, seed=seed, changes=changes, extra_nodes=[watcher]).run(seconds)
    return watcher


@pytest.mark.parametrize("changes", [(), QUICK_FIXES])
def test_a_healthy_flight_has_no_findings(fly, changes):
    assert watched(fly, "", 30.0, changes=changes).found == {}


@pytest.mark.parametrize("valve", [0, 3, 6])
def test_a_valve_stuck_open_is_named_within_a_second(fly, valve):
    found = watched(fly, "stuck_open_valve", FAULT_S + 2.0, seed=valve + 1, valve=valve).found
    assert list(found) == ["valve_stuck_open"]
    when_s, detail = found["valve_stuck_open"]
    assert FAULT_S < when_s < FAULT_S + 1.0
    assert f"valve {valve} " in detail


@pytest.mark.parametrize("valve", [0, 1])  # those that hold against the slope of this table
def test_a_valve_stuck_closed_is_named_within_a_fifth_of_a_second_of_its_on_time(fly, valve):
    watcher = watched(fly, "stuck_closed_valve", FAULT_S + 6.0, seed=valve + 1, valve=valve)
    assert list(watcher.found) == ["valve_stuck_closed"]
    assert f"valve {valve} " in watcher.found["valve_stuck_closed"][1]
    assert watcher.on_ms[valve] <= 200


def test_a_leaking_valve_is_named(fly):
    found = watched(fly, "leaking_valve", FAULT_S + 3.0, valve=5, fraction=0.4).found
    assert list(found) == ["valve_stuck_open"]
    assert "valve 5 gives " in found["valve_stuck_open"][1]


def test_a_burst_of_wrong_fixes_is_named_within_a_second(fly):
    found = watched(fly, "false_lights", FAULT_S + 2.0, changes=QUICK_FIXES).found
    assert list(found) == ["wrong_fixes"]
    assert FAULT_S < found["wrong_fixes"][0] < FAULT_S + 1.0
