"""What does not change about a vehicle, and how dry friction stops it when it is landed."""

import math
from dataclasses import dataclass

from firmware_emulator.plant.air_table import GRAVITY_M_S2
from firmware_emulator.plant.motion_state import Motion


@dataclass(frozen=True, slots=True)
class Body:
    """What does not change about a vehicle.

    Attributes:
        mass_kg: Mass.
        inertia_kg_m2: About the vertical through the centre of mass.
        centre_of_mass_body_m: In body axes from the body's origin.
        imu_body_m: Place of the accelerometers in body axes from the body's origin.
        radius_m: Of the bumper around the body's origin.
        drag_n_s_m: Air drag force per speed.
        drag_nm_s: Air drag torque per rate.
    """

    mass_kg: float = 11.0
    inertia_kg_m2: float = 0.25
    centre_of_mass_body_m: tuple[float, float] = (0.0, 0.0)
    imu_body_m: tuple[float, float] = (0.0, 0.0)
    radius_m: float = 0.2
    drag_n_s_m: float = 0.0
    drag_nm_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Push:
    """A force on the centre of mass, table frame, until a moment: a bumper being squeezed."""

    fx_n: float
    fy_n: float
    end_ns: int


class DryFriction:
    """Friction of a landed vehicle, spread evenly over the disc of its bumper.

    Turning is resisted with 2/3 of the disc's radius as arm. Coupling of sliding and turning is neglected:
    from 0.1 m/s it stops within 2 mm either way.
    """

    def __init__(self, coefficient: float, body: Body) -> None:
        self._slowing_m_s2 = coefficient * GRAVITY_M_S2
        arm_m = 2.0 / 3.0 * body.radius_m
        self._slowing_rad_s2 = self._slowing_m_s2 * body.mass_kg * arm_m / body.inertia_kg_m2

    def slide(self, now: Motion, duration_s: float) -> tuple[Motion, tuple[float, float]]:
        """Motion after sliding on for a while, and the acceleration meanwhile (table frame)."""
        speed_m_s = math.hypot(now.vx_m_s, now.vy_m_s)
        kept = max(0.0, 1.0 - self._slowing_m_s2 * duration_s / speed_m_s) if speed_m_s > 0.0 else 0.0
        slowed_rad_s = max(0.0, abs(now.rate_rad_s) - self._slowing_rad_s2 * duration_s)
        rate_rad_s = math.copysign(slowed_rad_s, now.rate_rad_s)
        vx, vy = kept * now.vx_m_s, kept * now.vy_m_s
        after = Motion(
            now.x_m + 0.5 * (now.vx_m_s + vx) * duration_s,
            now.y_m + 0.5 * (now.vy_m_s + vy) * duration_s,
            now.heading_rad + 0.5 * (now.rate_rad_s + rate_rad_s) * duration_s,
            vx,
            vy,
            rate_rad_s,
        )
        return after, ((vx - now.vx_m_s) / duration_s, (vy - now.vy_m_s) / duration_s)
