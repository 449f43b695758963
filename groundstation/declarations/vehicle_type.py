"""What a type of mock-up is: mass, inertia, valves. Parts add what else it carries."""

from __future__ import annotations

from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.declarations.section import Delay, Positive, Section


class ValvesSection(Section):
    """The default layout of eight valves, two per side at plus and minus ``arm_m``."""

    thrust_n: Positive = 0.22
    arm_m: Positive = 0.15
    min_on_s: Positive = 0.010
    open_delay_s: Delay = 0.006
    close_delay_s: Delay = 0.005
    rise_s: Delay = 0.004
    period_s: Positive = 0.1
    max_open_s: Positive = 2.0


class VehicleType(Section):
    """A type of mock-up; vehicles name one."""

    mass_kg: Positive = 11.0
    inertia_kg_m2: Positive = 0.25
    valves: ValvesSection = ValvesSection()

    def model(self) -> VehicleModel:
        """The mock-up as the control laws know it."""
        valves = square_of_eight(self.valves.arm_m, self.valves.thrust_n)
        return VehicleModel(self.mass_kg, self.inertia_kg_m2, valves)
