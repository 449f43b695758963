"""Conditions that a timeline waits for: what can be asked, how it is written, when it holds. Pure.

``alpha.settled``, ``alpha.landed``, ``distance_mm(alpha,beta) < 400``; several are joined by ``and``. They
are judged by what the station believes (the estimate), as an operator would; limits are judged by truth.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from groundstation.control.state import Vector2
from groundstation.declarations.rig import MOCK_UP_RADIUS_M
from groundstation.frames import wrap_angle
from groundstation.supervision.modes import Mode

SETTLED_M, SETTLED_RAD, SETTLED_M_S = 0.010, math.radians(1.0), 0.005
"""Settled is nearer than this to the setpoint, and slower ..."""
SETTLED_FOR_NS = 3_000_000_000
"""... for so long."""
STALE_NS = 1_000_000_000
"""What is older is not known."""
SETTLED = "settled"
FASTEST_MM_S = 1e5
"""No speed of a rig is above (``drivers.files.amounts``)."""


@dataclass(slots=True)
class Known:
    """What is known of one vehicle now.

    Attributes:
        state_ns: Stamp of the newest state; 0 without one.
        position_table_m, velocity_table_m_s, heading_rad: Of it.
        setpoint_ns: When the newest setpoint came; 0 without one.
        setpoint_table_m, setpoint_heading_rad: What its controller works for.
        mode: Of its supervisor; empty before it ruled.
        near_since_ns: Since when it has been within the bounds of *settled*; None while it is not.
    """

    state_ns: int = 0
    position_table_m: Vector2 = (math.nan, math.nan)
    velocity_table_m_s: Vector2 = (math.nan, math.nan)
    heading_rad: float = math.nan
    setpoint_ns: int = 0
    setpoint_table_m: Vector2 = (math.nan, math.nan)
    setpoint_heading_rad: float = math.nan
    mode: str = ""
    near_since_ns: int | None = None

    def look(self, now_ns: int) -> None:
        """Follow whether it is settled; call at every step."""
        is_near = (
            min(self.state_ns, self.setpoint_ns) > now_ns - STALE_NS
            and self.off_m < SETTLED_M
            and self.off_rad < SETTLED_RAD
            and math.hypot(*self.velocity_table_m_s) < SETTLED_M_S
        )
        if not is_near:
            self.near_since_ns = None
        elif self.near_since_ns is None:
            self.near_since_ns = now_ns

    @property
    def off_m(self) -> float:
        """Distance to the setpoint."""
        return math.dist(self.position_table_m, self.setpoint_table_m)

    @property
    def off_rad(self) -> float:
        """Turn to the setpoint."""
        return abs(wrap_angle(self.setpoint_heading_rad - self.heading_rad))

    def is_settled(self, since_ns: int, now_ns: int) -> bool:
        """Whether it has been settled for long enough, not counting what was before a moment."""
        return self.near_since_ns is not None and now_ns - max(self.near_since_ns, since_ns) >= SETTLED_FOR_NS


@dataclass(frozen=True, slots=True)
class Bounds:
    """What the table allows: half-open corners, m."""

    x_m: tuple[float, float]
    y_m: tuple[float, float]

    def edge_m(self, position_table_m: Vector2) -> float:
        """From the hull to the nearest edge; negative beyond it."""
        x, y = position_table_m
        return min(x - self.x_m[0], self.x_m[1] - x, y - self.y_m[0], self.y_m[1] - y) - MOCK_UP_RADIUS_M

    @property
    def middle_m(self) -> Vector2:
        """The place farthest from all edges."""
        return (self.x_m[0] + self.x_m[1]) / 2, (self.y_m[0] + self.y_m[1]) / 2

    @property
    def diagonal_m(self) -> float:
        """The longest way on the table."""
        return math.hypot(self.x_m[1] - self.x_m[0], self.y_m[1] - self.y_m[0])


def _distance_mm(bounds: Bounds, first: Known, second: Known) -> float:
    del bounds
    return 1e3 * (math.dist(first.position_table_m, second.position_table_m) - 2 * MOCK_UP_RADIUS_M)


@dataclass(frozen=True, slots=True)
class Measure:
    """A number that conditions can ask for.

    Attributes:
        summary: For people.
        takes: How many vehicles.
        value: From what is known of them.
        high: The largest value there can be, by the table; all are at least ``low``.
        low: The least.
    """

    summary: str
    takes: int
    value: Callable[..., float]
    high: Callable[[Bounds], float]
    low: float = 0.0


MEASURES: Mapping[str, Measure] = {
    "distance_mm": Measure(
        "between two hulls", 2, _distance_mm, lambda bounds: 1e3 * (bounds.diagonal_m - 2 * MOCK_UP_RADIUS_M)
    ),
    "edge_mm": Measure(
        "from the hull to the table's edge",
        1,
        lambda bounds, one: 1e3 * bounds.edge_m(one.position_table_m),
        lambda bounds: 1e3 * bounds.edge_m(bounds.middle_m),
        -math.inf,
    ),
    "speed_mm_s": Measure(
        "of the centre of mass",
        1,
        lambda bounds, one: 1e3 * math.hypot(*one.velocity_table_m_s),
        lambda bounds: FASTEST_MM_S,
    ),
    "position_error_mm": Measure(
        "to the controller's setpoint",
        1,
        lambda bounds, one: 1e3 * one.off_m,
        lambda bounds: 1e3 * bounds.diagonal_m,
    ),
    "heading_error_deg": Measure(
        "to the controller's setpoint", 1, lambda bounds, one: math.degrees(one.off_rad), lambda bounds: 180.0
    ),
}
"""THE TABLE of numbers; beside them ``settled`` and the modes of the supervisor."""
FLAGS = (SETTLED, *(mode.value for mode in Mode))


@dataclass(frozen=True, slots=True)
class Term:
    """One of the joined conditions.

    Attributes:
        vehicles: Whom it is about.
        flag: ``settled`` or a mode; empty for a number.
        measure: Row of the table; empty for a flag.
        is_below: Whether the number has to be below the bound.
        bound: Of the number.
    """

    vehicles: tuple[str, ...]
    flag: str = ""
    measure: str = ""
    is_below: bool = True
    bound: float = 0.0


@dataclass(slots=True)
class Condition:
    """A condition that has been read.

    Attributes:
        text: As it was written.
        terms: All have to hold.
    """

    text: str
    terms: tuple[Term, ...] = field(default_factory=tuple)

    def holds(self, known: Mapping[str, Known], bounds: Bounds, since_ns: int, now_ns: int) -> bool:
        """Whether all terms hold; what is not known does not.

        Args:
            known: By vehicle.
            bounds: Of the table.
            since_ns: When the waiting began: *settled* is not counted from before.
            now_ns: Now.
        """
        return all(_holds(term, known, bounds, since_ns, now_ns) for term in self.terms)


def _holds(term: Term, known: Mapping[str, Known], bounds: Bounds, since_ns: int, now_ns: int) -> bool:
    of = [known[name] for name in term.vehicles]
    if term.flag == SETTLED:
        return of[0].is_settled(since_ns, now_ns)
    if term.flag:
        return of[0].mode == term.flag
    if any(one.state_ns <= now_ns - STALE_NS for one in of):
        return False
    value = MEASURES[term.measure].value(bounds, *of)
    return value < term.bound if term.is_below else value > term.bound  # False for NaN
