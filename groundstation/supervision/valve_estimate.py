"""What identification of valves knows beforehand, and what it says."""

from dataclasses import dataclass
from typing import NamedTuple

LEARNED = 0.5
"""A value is known from flying once its sigma is below this share of what it was before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentificationConfig:
    """What is known beforehand; one sigma unless said otherwise.

    Attributes:
        imu_position_body_m: Accelerometers from the centre of mass.
        gyro_density_rad_s_rthz: White noise of the rate.
        acc_density_m_s2_rthz: White noise of the specific force.
        open_delay_s, close_delay_s, rise_s, sag: Of the rig.
        acc_lag_s, gyro_lag_s: Of the sensors' low-pass.
        block_s: Length of a block.
        step_s: Longest step in which pulses are laid beside samples.
        thrust_sigma: Of each valve's thrust over mass, and torque over inertia, over the rig's.
        delay_sigma_s: Of each valve's opening and closing delay.
        shift_sigma_s: By which all of them are late together, stamps included.
        jitter_sigma_s: Of the moment of an opening, from one to the next; what a pulse's shape differs by.
        model_sigma, model_sigma_s: Of thrust and torque, and of dead time: what no flight is long enough to
            learn, for sag and edges are not shaped as they are taken to be.
        sag_sigma: Of `sag`.
        lever_sigma_m: Of each component of `imu_position_body_m`.
        zero_sigma_m_s2, zero_walk_m_s2_rts: Of the accelerometers' zero, and its random walk.
        turn_sigma_rad_s2, turn_walk_rad_s2_rts: Of a torque that nothing here explains, and its random walk.
    """

    imu_position_body_m: tuple[float, float]
    gyro_density_rad_s_rthz: float
    acc_density_m_s2_rthz: float
    open_delay_s: float = 0.006
    close_delay_s: float = 0.005
    rise_s: float = 0.004
    sag: float = 0.97
    acc_lag_s: float = 0.0
    gyro_lag_s: float = 0.0
    block_s: float = 0.02
    step_s: float = 0.002
    thrust_sigma: float = 0.15
    delay_sigma_s: float = 0.001
    shift_sigma_s: float = 0.001
    jitter_sigma_s: float = 0.0007
    model_sigma: float = 0.006
    model_sigma_s: float = 1e-4
    sag_sigma: float = 0.02
    lever_sigma_m: float = 0.005
    zero_sigma_m_s2: float = 0.004
    zero_walk_m_s2_rts: float = 1e-4
    turn_sigma_rad_s2: float = 0.002
    turn_walk_rad_s2_rts: float = 2e-4


class Learned(NamedTuple):
    """A value and its sigma."""

    value: float
    sigma: float


@dataclass(frozen=True, slots=True)
class ValveEstimate:
    """What flying has told of a valve; None where it has told nothing worth its name.

    Attributes:
        thrust_over_mass: Over the rig's.
        torque_over_inertia: Over the rig's.
        dead_time_s: Opening less closing delay: by so much a pulse pushes shorter than it is commanded.
        open_s: How long it was open.
    """

    thrust_over_mass: Learned | None
    torque_over_inertia: Learned | None
    dead_time_s: Learned | None
    open_s: float
