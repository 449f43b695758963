"""Braking: the stop that is right for a table without friction.

Closed valves mean coasting off the edge, so a stop first takes the speed away: force against the velocity,
torque against the turn, as strong as the valves allow until nearly at rest, then proportional. Needs no goal
and no memory, only a fresh state.
"""

import math
from dataclasses import replace

from pydantic import ConfigDict, Field

from groundstation.control.state import BodyWrench, ControlState, limit_length, rotate
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.files.plain_model import PlainModel
from groundstation.frames import wrap_angle


class BrakeConfig(PlainModel):
    """Damping and the speeds below which braking ends.

    Attributes:
        damping_per_s: Deceleration per speed; for speed and turn alike. Times the delay of state and valves
            it should stay below one half.
        rest_speed_m_s: Speed that counts as rest: noise of the estimate, not worth gas.
        rest_rate_deg_s: Turn rate that counts as rest.
        torque_share: Of the largest torque; the rest of the valves' time is left for the force, for it
            is the speed that carries a mock-up off the table.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    damping_per_s: float = Field(default=2.0, gt=0.0)
    rest_speed_m_s: float = Field(default=0.002, ge=0.0)
    rest_rate_deg_s: float = Field(default=1.0, ge=0.0)
    torque_share: float = Field(default=0.25, gt=0.0, le=1.0)


def brake_wrench(
    state: ControlState, config: BrakeConfig, vehicle: VehicleModel, envelope: WrenchEnvelope
) -> BodyWrench:
    """Wrench that takes speed and turn away, within the valves.

    Args:
        state: Fresh estimate; braking on a stale one could accelerate.
        config: Damping.
        vehicle: Mass properties.
        envelope: What the vehicle's valves can make.
    """
    speed = math.hypot(*state.velocity_table_m_s)
    excess = max(0.0, speed - config.rest_speed_m_s)
    strength = min(vehicle.mass_kg * config.damping_per_s * excess, 2.0 * envelope.max_force_n)
    # limited first, so that the direction of a huge velocity survives
    direction = limit_length(state.velocity_table_m_s, 1.0)
    length = math.hypot(*direction)
    push = strength / length if length > 0.0 else 0.0
    against = rotate((-push * direction[0], -push * direction[1]), -wrap_angle(state.heading_rad))
    turning = max(0.0, abs(state.rate_rad_s) - math.radians(config.rest_rate_deg_s))
    torque = vehicle.inertia_kg_m2 * config.damping_per_s * turning
    torque = min(torque, config.torque_share * envelope.max_torque_nm)
    return envelope.saturate(BodyWrench(against, -math.copysign(torque, state.rate_rad_s)))


def dead_reckoned(
    state: ControlState, wrench: BodyWrench, span_s: float, vehicle: VehicleModel
) -> ControlState:
    """The state after a wrench has acted for a while: what is left to brake on when no estimate comes.

    Assumes a level table without friction and the valves' nominal thrust, so the speed that is left grows
    uncertain by a tenth of what was braked away; good for a second or two.
    """
    middle_rad = state.heading_rad + 0.5 * state.rate_rad_s * span_s
    force = rotate(wrench.force_body_n, middle_rad)
    ax, ay = force[0] / vehicle.mass_kg, force[1] / vehicle.mass_kg
    (x, y), (vx, vy) = state.position_table_m, state.velocity_table_m_s
    turning = wrench.torque_nm / vehicle.inertia_kg_m2
    return replace(
        state,
        position_table_m=(x + vx * span_s + 0.5 * ax * span_s**2, y + vy * span_s + 0.5 * ay * span_s**2),
        velocity_table_m_s=(vx + ax * span_s, vy + ay * span_s),
        heading_rad=state.heading_rad + state.rate_rad_s * span_s + 0.5 * turning * span_s**2,
        rate_rad_s=state.rate_rad_s + turning * span_s,
    )
