"""Every payload of the bus. One class per topic; the topic table names rates and policies."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.messages.base import (
    F64,
    I64,
    U8,
    U16,
    U32,
    U64,
    Bool,
    Bytes,
    Float32Array,
    Float64Sequence,
    Float64x2,
    Float64x3,
    Float64x9,
    Message,
    Text,
    TextSequence,
)

PACKAGE = "air_table_msgs"
NO_STOP = 255


@dataclass(frozen=True, slots=True, eq=False)
class ImuBytes(Message):
    """A read of the IMU block's serial port; the stamp is the arrival of its last byte."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ImuBytes"
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class ImuOrder(Message):
    """Bytes for the IMU block (set averaging, self-test, ...), ready to be written."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ImuOrder"
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class FixBytes(Message):
    """A read of an external pose stream that serves as star fixes."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FixBytes"
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceBytes(Message):
    """A read of the reference stream (truth of the emulator, or motion capture)."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ReferenceBytes"
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class StarImage(Message):
    """One grey frame of the star camera; the stamp is the middle of the exposure."""

    ROS_TYPE: ClassVar[str] = "sensor_msgs/msg/Image"
    height: U32
    width: U32
    encoding: Text
    is_bigendian: U8
    step: U32
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class StarSpots(Message):
    """Spots of light found in one frame, brightest first; stamp and vehicle are the frame's.

    Attributes:
        arrival_ns: When the frame reached the node that looked into it.
        u_px: Column of each centre, pixel (0, 0) is the centre of the top-left pixel.
        v_px: Row of each centre.
        flux_dn: Light above the background.
        covariance_px2: uu, uv, vv of each centre, one after the other.
        elongation: Ratio of the spot's principal axes, 1 is round.
        streak_px: Motion streak du, dv of each spot, one after the other.
        background_dn: Median grey level of the frame.
        noise_dn: Standard deviation of the background.
        hot_pixels: Groups dropped as hot pixels.
        cut_by_edge: Spots dropped at the frame's edge.
        flooded: More light than a sky of stars can have.
        reason: Empty, or why the frame cannot be looked into.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/StarSpots"
    arrival_ns: I64
    u_px: Float32Array
    v_px: Float32Array
    flux_dn: Float32Array
    covariance_px2: Float32Array
    elongation: Float32Array
    streak_px: Float32Array
    background_dn: F64
    noise_dn: F64
    hot_pixels: U16
    cut_by_edge: U16
    flooded: Bool
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class StarFix(Message):
    """The answer of the star tracker to one frame; the stamp is the middle of the exposure.

    Attributes:
        fix: Whether there is a pose; without one the pose is NaN and ``reason`` says why.
        x_m: Body origin in the table frame.
        y_m: Body origin in the table frame.
        heading_rad: Heading in [-pi, pi).
        covariance: Row-major 3 x 3 of (x, y, heading) in m and rad.
        stamp_sigma_s: Standard deviation of the stamp against the host's clock.
        stars: Number of stars used.
        mode: How it was found: ``lost-in-space``, ``tracking`` or ``external``.
        reason: Empty, or why there is no fix.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/StarFix"
    fix: Bool
    x_m: F64
    y_m: F64
    heading_rad: F64
    covariance: Float64x9
    stamp_sigma_s: F64
    stars: U16
    mode: Text
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class ImuRaw(Message):
    """One frame of the IMU block in counts, as the driver parsed it.

    Attributes:
        version: Frame version, 1 or 2.
        tick_ms: Unwrapped 1 kHz tick of the MCU at the end of the averaging window.
        sample_count: Polls averaged.
        gyro_counts: Averaged offset-binary code.
        tilt_counts: x.X, x.Y, y.X, y.Y; empty where the frame has none (version 1).
        tilt_difference_counts: X - Y of the x and of the y chip.
        status: Status bits of the firmware last heard, 0 if none.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ImuRaw"
    version: U8
    tick_ms: U64
    sample_count: U16
    gyro_counts: F64
    tilt_counts: Float64Sequence
    tilt_difference_counts: Float64x2
    status: U16


@dataclass(frozen=True, slots=True, eq=False)
class Imu(Message):
    """Calibrated averages over one window; the stamp is the END of the window.

    Attributes:
        tick_ms: Unwrapped 1 kHz tick of the MCU at the end of the window; begins anew with the block.
        elapsed_ms: Ticks since the sample before, 0 after a restart: what an integration has to use.
        window_s: Length of the averaging window by the MCU's clock.
        stamp_sigma_s: Standard deviation of the stamp, phase bias included.
        rate_body_rad_s: Turn rate about body z, scale applied, zero offset not removed.
        force_body_m_s2: Specific force along body x, y; zero offset not removed.
        temperature_c: Temperature of the block, NaN where unknown.
        valid: False where a plausibility check failed.
        reason: Empty, or the failed check.
        frames_lost: Frames missing so far between MCU and here, by tick or sequence.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ImuSample"
    tick_ms: U64
    elapsed_ms: U32
    window_s: F64
    stamp_sigma_s: F64
    rate_body_rad_s: F64
    force_body_m_s2: Float64x2
    temperature_c: F64
    valid: Bool
    reason: Text
    frames_lost: U32


@dataclass(frozen=True, slots=True, eq=False)
class VehicleState(Message):
    """State of the centre of mass at the end of an IMU window.

    Attributes:
        position_table_m: x, y.
        heading_rad: In [-pi, pi).
        velocity_table_m_s: x, y.
        rate_rad_s: Bias-corrected turn rate.
        pose_std: Standard deviations of x, y (m) and heading (rad).
        status: ``starting``, ``resting``, ``flying`` or ``lost``.
        fix_stamp_ns: Exposure of the newest fix inside, 0 before the first.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/VehicleState"
    position_table_m: Float64x2
    heading_rad: F64
    velocity_table_m_s: Float64x2
    rate_rad_s: F64
    pose_std: Float64x3
    status: Text
    fix_stamp_ns: I64


@dataclass(frozen=True, slots=True, eq=False)
class FixAccount(Message):
    """What fusion did with one fix; the stamp is the fix's exposure."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FixAccount"
    used: Bool
    reason: Text
    innovation: Float64x3
    nis: F64
    age_s: F64


@dataclass(frozen=True, slots=True, eq=False)
class FusionStatus(Message):
    """How the estimator is doing, a few times a second.

    Attributes:
        status: As in ``VehicleState``.
        method: Row of the table of estimators.
        bias_rate_rad_s: What is subtracted from the gyro.
        bias_force_m_s2: What is subtracted from the accelerometers (body).
        rest_s: Length of the rest used so far for zero offsets.
        fixes_used: Since start.
        fixes_refused: Since start.
        fix_age_s: Since the exposure of the newest used fix, infinity before the first.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FusionStatus"
    status: Text
    method: Text
    bias_rate_rad_s: F64
    bias_force_m_s2: Float64x2
    rest_s: F64
    fixes_used: U32
    fixes_refused: U32
    fix_age_s: F64


@dataclass(frozen=True, slots=True, eq=False)
class Wrench(Message):
    """Force and torque asked for by the controller, body frame; z components of the other axes are 0."""

    ROS_TYPE: ClassVar[str] = "geometry_msgs/msg/WrenchStamped"
    force_x_n: F64
    force_y_n: F64
    force_z_n: F64
    torque_x_nm: F64
    torque_y_nm: F64
    torque_z_nm: F64


@dataclass(frozen=True, slots=True, eq=False)
class ControlStatus(Message):
    """The goal in force and the distance to it."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ControlStatus"
    controller: Text
    goal_position_table_m: Float64x2
    goal_heading_rad: F64
    error_position_m: F64
    error_heading_rad: F64


@dataclass(frozen=True, slots=True, eq=False)
class ValveDemand(Message):
    """On-times of the next modulation period, as the allocation asks for them.

    Attributes:
        on_time_ms: Per valve, 0 to 127.
        delivered_force_body_n: Mean force that these pulses are expected to give over the period.
        delivered_torque_nm: Mean torque, likewise.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveDemand"
    on_time_ms: Bytes
    delivered_force_body_n: Float64x2
    delivered_torque_nm: F64


@dataclass(frozen=True, slots=True, eq=False)
class ValveSelection(Message):
    """What the command multiplexer chose, and whose it is.

    Attributes:
        counter: Of the selections said, modulo 16.
        pulse_id: Changes with every new pulse, modulo 16.
        on_time_ms: Per valve, 0 to 127.
        source: ``stop``, ``brake``, ``operator``, ``controller`` or ``closed``.
        reason: Why this source.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveSelection"
    counter: U8
    pulse_id: U8
    on_time_ms: Bytes
    source: Text
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class ValveCommand(Message):
    """What the guard lets through; sent every 20 ms, closed unless armed and fresh.

    Attributes:
        counter: Of the frames sent, modulo 16.
        pulse_id: Of the guard's own pulses, modulo 16.
        on_time_ms: Remaining on-time per valve.
        gate: ``open``, or why the valves are closed.
        open_mask: Bit i: valve i is open after this frame.
        stop_reason: Code of the latched stop, ``NO_STOP`` without one.
        arm: 0 nothing to say, 1 disarm the node, 2 arm it.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveCommand"
    counter: U8
    pulse_id: U8
    on_time_ms: Bytes
    gate: Text
    open_mask: U8
    stop_reason: U8
    arm: U8


@dataclass(frozen=True, slots=True, eq=False)
class CanIn(Message):
    """A CAN frame that arrived from the valve bus."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CanIn"
    arbitration_id: U32
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class CanOut(Message):
    """A CAN frame for the valve bus."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CanOut"
    arbitration_id: U32
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class ValveStatus(Message):
    """What the valve node of a mock-up reports.

    Attributes:
        open_mask: Bit i is valve i.
        counter: Of the command executed last.
        armed: Commands are being executed.
        dead_man: The node closed its valves because nobody spoke to it.
        floating: The float air is on.
        pressure_pa: Tank pressure, NaN before the first report.
        faults: Fault bits.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveStatus"
    open_mask: U8
    counter: U8
    armed: Bool
    dead_man: Bool
    floating: Bool
    pressure_pa: F64
    faults: U8


@dataclass(frozen=True, slots=True, eq=False)
class Request(Message):
    """Something asked of a vehicle; answered on ``ack``.

    Attributes:
        request_id: Unique per author.
        author: Who asks.
        action: A row of the table of actions: arm, disarm, stop, release, float_on, float_off, go_to, ...
        argument: Numbers of the action, for ``go_to``: x, y (m), heading (rad).
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Request"
    request_id: U32
    author: Text
    action: Text
    argument: Float64Sequence


@dataclass(frozen=True, slots=True, eq=False)
class Ack(Message):
    """The answer to a request."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Ack"
    request_id: U32
    author: Text
    action: Text
    accepted: Bool
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class VehicleMode(Message):
    """Armed state and the reason for it; latched."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/VehicleMode"
    armed: Bool
    stopped: Bool
    source: Text
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class SequencePhase(Message):
    """Where the start sequence of a mock-up is; latched."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/SequencePhase"
    phase: Text
    detail: Text


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceState(Message):
    """Pose and velocity by the reference system; for view, recorder and report only."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ReferenceState"
    position_table_m: Float64x2
    heading_rad: F64
    velocity_table_m_s: Float64x2
    rate_rad_s: F64


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationInUse(Message):
    """A calibration file as loaded, with its hash; latched."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CalibrationInUse"
    name: Text
    sha256: Text
    content: Text


@dataclass(frozen=True, slots=True, eq=False)
class Diagnostics(Message):
    """Counters and health of one node, once a second."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Diagnostics"
    node: Text
    level: U8
    summary: Text
    keys: TextSequence
    values: TextSequence


@dataclass(frozen=True, slots=True, eq=False)
class Journal(Message):
    """What one process consumed and said, in order: packed entries of ``runtime.journal``."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Journal"
    process: Text
    names: TextSequence
    entries: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class Latency(Message):
    """Ages along the chain from light to valve, per vehicle, over the last seconds.

    Attributes:
        stages: Names, in the order of the chain.
        p50_s: Median age per stage.
        p99_s: 99th percentile per stage.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Latency"
    stages: TextSequence
    p50_s: Float64Sequence
    p99_s: Float64Sequence
