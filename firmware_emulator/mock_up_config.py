"""One mock-up of the scenario: its body and its valves."""

from typing import Annotated

from pydantic import Field, model_validator

from drivers.valve_bus.protocol import VALVES
from firmware_emulator.settings import Fraction, NonNegative, Pair, Positive, Settings


class ThrusterConfig(Settings):
    """One valve and its nozzle."""

    position_body_m: Pair
    direction_body: Pair
    """Direction of the force on the vehicle (opposite to the gas), normalised on use."""
    thrust_n: Positive = 0.22

    @model_validator(mode="after")
    def _direction_points_somewhere(self) -> "ThrusterConfig":
        if self.direction_body == (0.0, 0.0):
            raise ValueError("direction_body must not be zero")
        return self


def _pairs_on_each_side() -> tuple[ThrusterConfig, ...]:
    arm_m = 0.15
    return tuple(
        ThrusterConfig(position_body_m=position, direction_body=direction)
        for direction, places in (
            ((1.0, 0.0), ((-arm_m, arm_m), (-arm_m, -arm_m))),
            ((-1.0, 0.0), ((arm_m, arm_m), (arm_m, -arm_m))),
            ((0.0, 1.0), ((arm_m, -arm_m), (-arm_m, -arm_m))),
            ((0.0, -1.0), ((arm_m, arm_m), (-arm_m, arm_m))),
        )
        for position in places
    )


class ValveConfig(Settings):
    """Cold-gas supply and valves, defaults as for fast miniature valves on laboratory mock-ups."""

    open_delay_s: NonNegative = 0.006
    open_delay_sd_s: NonNegative = 0.0005
    """From pulse to pulse."""
    close_delay_s: NonNegative = 0.005
    rise_s: Positive = 0.004
    """Time constant of thrust build-up and decay."""
    minimum_on_ms: Annotated[int, Field(ge=0, le=127)] = 10
    """The node refuses shorter pulses: the poppet would not lift reliably."""
    spread: Fraction = 0.05
    """Thrust of each valve differs from nominal by up to this fraction, drawn once."""
    sag: Annotated[float, Field(gt=0.0, le=1.0)] = 0.97
    """Thrust factor per further open valve (SPHERES guest code models its supply so)."""
    tank_pa: Positive = 20e6
    supply_pa: Positive = 0.6e6
    """Set point of the regulator."""
    tank_impulse_n_s: Positive = 300.0
    """What a full tank can give; 1 l of air at 200 bar and 50 s of specific impulse gives about 120 N s."""


class VehicleConfig(Settings):
    """One mock-up, beside the sections of the devices that it carries (`device_table.read_config`)."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    mass_kg: Positive = 11.0
    inertia_kg_m2: Positive = 0.25
    """About the vertical through the centre of mass."""
    centre_of_mass_body_m: Pair = (0.0, 0.0)
    radius_m: Positive = 0.2
    """Of the bumper, around the body's origin."""
    start_m: Pair = (0.0, 0.0)
    """Body origin in the table frame."""
    start_heading_deg: float = 0.0
    start_velocity_m_s: Pair = (0.0, 0.0)
    start_rate_deg_s: float = 0.0
    floating: bool = False
    """Whether float air is on at the start."""
    float_delay_s: NonNegative = 0.2
    """From the command until the bearings lift, or set down."""
    drag_n_s_m: NonNegative = 0.002
    """Air drag in proportion to speed."""
    drag_nm_s: NonNegative = 1e-5
    thrusters: tuple[ThrusterConfig, ...] = Field(default_factory=_pairs_on_each_side)
    valves: ValveConfig = ValveConfig()
    reference_rate_hz: NonNegative = 50.0
    """Poses per second of the truth stream; 0 for none."""
    reference_delay_s: Annotated[float, Field(ge=0.0, le=4.0)] = 0.002
    seed_offset: Annotated[int, Field(ge=0)] = 0
    """Added to the seed of this vehicle's random numbers."""

    @model_validator(mode="after")
    def _valves_fit_the_bus(self) -> "VehicleConfig":
        if len(self.thrusters) != VALVES:
            raise ValueError(f"thrusters must be {VALVES}, got {len(self.thrusters)}")
        return self
