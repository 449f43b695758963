"""Formation: hold a pose relative to other mock-ups.

Each neighbour fixes where this mock-up should be: at a fixed offset, either along the table's axes or carried
by the neighbour's own heading. The setpoint is the weighted mean of these and of the own goal; with one
neighbour and no goal weight this is leader and follower, with mutual neighbours it is the consensus law for
relative states with a leader (W. Ren, R. Beard, Distributed Consensus in Multi-vehicle Cooperative Control,
2008, section 4.2). A neighbour that falls silent drops out of the mean; with none left, the last setpoint is
held at rest.
"""

import math
from collections.abc import Mapping

from pydantic import ConfigDict, Field, model_validator

from groundstation.control.at_setpoint import AtSetpoint
from groundstation.control.go_to import GoToConfig
from groundstation.control.keep_in import KeepIn
from groundstation.control.state import ControlState, Goal, Vector2, rotate
from groundstation.control.vehicle import VehicleModel
from groundstation.files.plain_model import PlainModel
from groundstation.frames import wrap_angle


class RelativePose(PlainModel):
    """Where to be relative to one neighbour.

    Attributes:
        offset_m: This mock-up's position less the neighbour's, (x, y).
        heading_deg: This mock-up's heading less the neighbour's.
        carried: The offset is in the neighbour's body axes and turns with it; otherwise in the table's axes,
            and the heading is that of the goal plus `heading_deg`.
        weight: Share in the mean.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    offset_m: tuple[float, float]
    heading_deg: float = 0.0
    carried: bool = True
    weight: float = Field(default=1.0, gt=0.0)


class FormationConfig(PlainModel):
    """Neighbours by name, how much the own goal counts, and how to get there."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    neighbours: dict[str, RelativePose] = Field(default_factory=dict)
    goal_weight: float = Field(default=0.0, ge=0.0)
    go_to: GoToConfig = GoToConfig()

    @model_validator(mode="after")
    def _has_something_to_hold(self) -> "FormationConfig":
        if not self.neighbours and self.goal_weight == 0.0:
            raise ValueError("a formation needs neighbours, or a goal_weight above 0")
        return self


class Formation(AtSetpoint):
    """Controller row ``formation``."""

    def __init__(self, config: FormationConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        super().__init__(config.go_to, vehicle, keep_in)
        self._config = config

    def wanted(self, state: ControlState, goal: Goal, neighbours: Mapping[str, ControlState]) -> Goal | None:
        """Weighted mean of what the neighbours and the goal ask for; None when nobody asks."""
        del state
        asked: list[tuple[float, Goal]] = []
        if self._config.goal_weight > 0.0:
            asked.append((self._config.goal_weight, goal))
        for name, relative in self._config.neighbours.items():
            if name in neighbours:
                asked.append((relative.weight, _asked_by(neighbours[name].bounded(), relative, goal)))
        if not asked:
            return None
        total = math.fsum(weight for weight, _ in asked)
        shares = [(weight / total, wanted) for weight, wanted in asked]
        # headings are averaged as small turns from the first, for angles have no mean of their own
        first_rad = asked[0][1].heading_rad
        turn_rad = math.fsum(share * wrap_angle(wanted.heading_rad - first_rad) for share, wanted in shares)
        return Goal(
            _mean([(share, wanted.position_table_m) for share, wanted in shares]),
            wrap_angle(first_rad + turn_rad),
            _mean([(share, wanted.velocity_table_m_s) for share, wanted in shares]),
            math.fsum(share * wanted.rate_rad_s for share, wanted in shares),
        )


def _asked_by(neighbour: ControlState, relative: RelativePose, goal: Goal) -> Goal:
    """Pose and velocity that one neighbour asks for."""
    x, y = neighbour.position_table_m
    turn_rad = math.radians(relative.heading_deg)
    if not relative.carried:
        place = (x + relative.offset_m[0], y + relative.offset_m[1])
        return Goal(place, goal.heading_rad + turn_rad, neighbour.velocity_table_m_s, goal.rate_rad_s)
    heading_rad, rate, velocity = neighbour.heading_rad, neighbour.rate_rad_s, neighbour.velocity_table_m_s
    lever = rotate(relative.offset_m, heading_rad)
    carried = (velocity[0] - rate * lever[1], velocity[1] + rate * lever[0])
    return Goal((x + lever[0], y + lever[1]), heading_rad + turn_rad, carried, rate)


def _mean(shares: list[tuple[float, Vector2]]) -> Vector2:
    return (
        math.fsum(share * value[0] for share, value in shares),
        math.fsum(share * value[1] for share, value in shares),
    )
