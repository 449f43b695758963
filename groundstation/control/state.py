"""What a controller reads and writes: where the mock-up is, where it should be, what should push it.

Tuples of floats rather than arrays: the law runs on three axes, and an array of two costs more than its sums.
"""

import math
from dataclasses import dataclass, replace

from drivers.quick_record import quickly_made
from groundstation.frames import wrap_angle

LENGTH_BOUND_M = 1e6  # far beyond any table: keeps sums finite whatever comes in
SPEED_BOUND = 1e3  # m/s, rad/s and their derivatives: nothing on a table is faster

Vector2 = tuple[float, float]
"""Two components along x and y of the frame that the name states."""


def rotate(vector: Vector2, angle_rad: float) -> Vector2:
    """Turn a vector counter-clockwise; body to table with the heading, table to body with its negative."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    return cosine * vector[0] - sine * vector[1], sine * vector[0] + cosine * vector[1]


def limit_length(vector: Vector2, limit: float) -> Vector2:
    """The vector itself, or one of the same direction that is `limit` long."""
    length = math.hypot(*vector)
    if length <= limit:
        return vector
    scale = limit / length
    return vector[0] * scale, vector[1] * scale


def clamp(value: float, limit: float) -> float:
    """The value within +-limit."""
    return min(max(value, -limit), limit)


def bounded(vector: Vector2, limit: float) -> Vector2:
    """Each component within +-limit."""
    return clamp(vector[0], limit), clamp(vector[1], limit)


def _refuse_non_finite(what: str, *values: float) -> None:
    if not math.isfinite(sum(values)) and not all(map(math.isfinite, values)):  # a sum is the cheaper look
        raise ValueError(f"{what} must be finite, found {values}")


@quickly_made
@dataclass(frozen=True, slots=True)
class ControlState:
    """Estimated state of one mock-up at one moment.

    Attributes:
        position_table_m: Centre of mass, (x, y).
        velocity_table_m_s: Of the centre of mass, (x, y).
        heading_rad: Counter-clockwise from table +x to body +x, any branch.
        rate_rad_s: Turn rate, counter-clockwise positive.
        slope_table_m_s2: Acceleration that the table is known to add here (slope map), (x, y).

    Raises:
        ValueError: A component is not finite.
    """

    position_table_m: Vector2
    velocity_table_m_s: Vector2
    heading_rad: float
    rate_rad_s: float
    slope_table_m_s2: Vector2 = (0.0, 0.0)

    def __post_init__(self) -> None:
        _refuse_non_finite(
            "state",
            *self.position_table_m,
            *self.velocity_table_m_s,
            self.heading_rad,
            self.rate_rad_s,
            *self.slope_table_m_s2,
        )

    def bounded(self) -> "ControlState":
        """The same with absurd numbers cut to the bounds and the heading within [-pi, pi)."""
        return ControlState(
            bounded(self.position_table_m, LENGTH_BOUND_M),
            bounded(self.velocity_table_m_s, SPEED_BOUND),
            wrap_angle(self.heading_rad),
            clamp(self.rate_rad_s, SPEED_BOUND),
            bounded(self.slope_table_m_s2, SPEED_BOUND),
        )

    def carried(self, span_s: float) -> "ControlState":
        """The same after coasting for a while: brings a late state to the present."""
        (x, y), (speed_x, speed_y) = self.position_table_m, self.velocity_table_m_s
        return replace(
            self,
            position_table_m=(x + speed_x * span_s, y + speed_y * span_s),
            heading_rad=self.heading_rad + self.rate_rad_s * span_s,
        )


@dataclass(frozen=True, slots=True)
class Goal:
    """Pose to reach or to follow, with what is known of its motion.

    Attributes:
        position_table_m: Where the centre of mass should be, (x, y).
        heading_rad: Where body +x should point.
        velocity_table_m_s: Velocity of that point.
        rate_rad_s: Rate of that heading.
        acceleration_table_m_s2: Acceleration of that point, fed forward.
        angular_acceleration_rad_s2: Acceleration of that heading, fed forward.

    Raises:
        ValueError: A component is not finite.
    """

    position_table_m: Vector2
    heading_rad: float
    velocity_table_m_s: Vector2 = (0.0, 0.0)
    rate_rad_s: float = 0.0
    acceleration_table_m_s2: Vector2 = (0.0, 0.0)
    angular_acceleration_rad_s2: float = 0.0

    def __post_init__(self) -> None:
        _refuse_non_finite(
            "goal",
            *self.position_table_m,
            self.heading_rad,
            *self.velocity_table_m_s,
            self.rate_rad_s,
            *self.acceleration_table_m_s2,
            self.angular_acceleration_rad_s2,
        )

    def bounded(self) -> "Goal":
        """The same with absurd numbers cut to the bounds and the heading within [-pi, pi)."""
        return Goal(
            bounded(self.position_table_m, LENGTH_BOUND_M),
            wrap_angle(self.heading_rad),
            bounded(self.velocity_table_m_s, SPEED_BOUND),
            clamp(self.rate_rad_s, SPEED_BOUND),
            bounded(self.acceleration_table_m_s2, SPEED_BOUND),
            clamp(self.angular_acceleration_rad_s2, SPEED_BOUND),
        )


@quickly_made
@dataclass(frozen=True, slots=True)
class BodyWrench:
    """Force through the centre of mass, body axes, and torque about the vertical."""

    force_body_n: Vector2
    torque_nm: float

    def __post_init__(self) -> None:
        _refuse_non_finite("wrench", *self.force_body_n, self.torque_nm)


NO_WRENCH = BodyWrench((0.0, 0.0), 0.0)
"""Nothing pushes."""
