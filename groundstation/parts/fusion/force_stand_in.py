"""Stands in for accelerometers that are not believed: what the commanded valves should make them read."""

from groundstation.control.valve_push import ValvePush
from groundstation.fusion.estimator import Estimator
from groundstation.parts.imu.messages import USABLE_FORCE_X, USABLE_FORCE_Y, Imu
from groundstation.parts.valves.messages import ValveCommand

_FORCES = USABLE_FORCE_X | USABLE_FORCE_Y


class ForceStandIn:
    """Readings of both accelerometers of a sample, made up where one is not usable.

    Args:
        estimator: Knows the offsets; it is given which axes it should not believe.
        push: Commanded pulses of the valves.
        mass_kg: Of the vehicle.
        inertia_kg_m2: Likewise.
    """

    def __init__(self, estimator: Estimator, push: ValvePush, mass_kg: float, inertia_kg_m2: float) -> None:
        self._estimator = estimator
        self._push = push
        self._mass_kg, self._inertia_kg_m2 = mass_kg, inertia_kg_m2
        self._usable = _FORCES

    @property
    def complaint(self) -> str:
        """Which accelerometer is not believed, in words; empty when both are."""
        names = (("x", USABLE_FORCE_X), ("y", USABLE_FORCE_Y))
        lost = [name for name, bit in names if not self._usable & bit]
        if not lost:
            return ""
        return f"accelerometer {' and '.join(lost)} not believed: flying by gyro, fixes and valve commands"

    def receive(self, command: ValveCommand, now_ns: int) -> None:
        """Take what the guard lets through, at the moment it is received."""
        self._push.command(now_ns, command.pulse_id, command.on_time_ms)

    def forces(self, imu: Imu, span_s: float) -> tuple[float, float]:
        """Return the specific forces of a sample, body axes.

        Args:
            imu: The sample.
            span_s: What it stands for, up to its stamp.
        """
        usable = imu.usable & _FORCES
        start_ns = imu.stamp_ns - round(span_s * 1e9)
        if usable != self._usable:
            self._usable = usable
            self._estimator.doubt_forces(
                start_ns, x=not usable & USABLE_FORCE_X, y=not usable & USABLE_FORCE_Y
            )
        if usable == _FORCES:
            return imu.force_body_m_s2
        wrench = self._push.mean(start_ns, imu.stamp_ns)
        push = (wrench.force_body_n[0] / self._mass_kg, wrench.force_body_n[1] / self._mass_kg)
        made_up = self._estimator.expected_forces(
            imu.rate_body_rad_s, push, wrench.torque_nm / self._inertia_kg_m2
        )
        x, y = imu.force_body_m_s2
        return (
            x if usable & USABLE_FORCE_X else made_up[0],
            y if usable & USABLE_FORCE_Y else made_up[1],
        )
