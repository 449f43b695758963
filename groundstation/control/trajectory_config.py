"""What a reconfiguration is asked for: where to, what is kept to, what becomes of an empty place."""

from typing import TYPE_CHECKING, Literal

from pydantic import ConfigDict, Field

from groundstation.control.keep_in import KeepIn
from groundstation.control.safety_filter import SafetyFilterConfig
from groundstation.control.state import Vector2
from groundstation.control.station import StationConfig
from groundstation.files.plain_model import PlainModel

if TYPE_CHECKING:
    from groundstation.control.trajectories import Margins, Reconfiguration

FILTER = SafetyFilterConfig()
"""What the filter behind every controller lets pass: who closes in at v has v / gain of room left to it."""
_STOPPING_GAP_M = 0.04  # what the filter keeps between hulls, and what estimates are off by


class TrajectoryConfig(PlainModel):
    """From where to where, and what is kept to.

    Attributes:
        ship: The own name; the rig's where it is left out.
        starts_m: Where each ship begins; the rig's poses to hold of all that fly this law where left out.
        places_m: Where they are to be.
        assign: ``as_listed``: the first ship gets the first place, and so on. ``squared_distance``,
            ``time``: at the least sum of these.
        empty: What becomes of the place of a ship that has come down, once all others are at theirs:
            ``keep`` leaves it, ``fill`` moves the others up, so that the last of the places fall empty.
        duration_s: From rest to rest; left out, it is chosen.
        gap_m: Between two hulls.
        speed_m_s: Largest speed.
        acceleration_m_s2: Largest acceleration.
        braking_m_s2: What every ship's valves can be counted on for.
        obstacles_m: x, y, radius of each.
        station: Of the law that follows the plan.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    ship: str = ""
    starts_m: dict[str, Vector2] = Field(default_factory=dict)
    places_m: tuple[Vector2, ...] = Field(min_length=1)
    assign: Literal["as_listed", "squared_distance", "time"] = "as_listed"
    empty: Literal["keep", "fill"] = "keep"
    duration_s: float | None = Field(default=None, gt=0.0, le=3600.0)
    gap_m: float = Field(default=0.12, ge=0.02, le=2.0)
    speed_m_s: float = Field(default=0.10, gt=0.0, le=1.0)
    acceleration_m_s2: float = Field(default=0.015, gt=0.0, le=1.0)
    braking_m_s2: float = Field(default=0.025, gt=0.0, le=1.0)
    obstacles_m: tuple[tuple[float, float, float], ...] = ()
    station: StationConfig = StationConfig()

    def assigned(self) -> dict[str, int]:
        """The number of each ship's place; ships in the order of `starts_m`.

        Raises:
            ValueError: There are fewer places than ships.
        """
        # half a second of SciPy, which rigs without a plan need not have
        from groundstation.control.assignment import assign

        cost = "squared_distance" if self.assign == "as_listed" else self.assign
        chosen = assign(  # refuses fewer places, too
            self.starts_m,
            self.places_m,
            cost,
            speed_m_s=self.speed_m_s,
            acceleration_m_s2=self.acceleration_m_s2,
        )
        if self.assign == "as_listed":
            return {name: number for number, name in enumerate(self.starts_m)}
        return {name: chosen[name] for name in self.starts_m}

    def asked(self, keep_in: KeepIn | None) -> "Reconfiguration":
        """What is to be planned; ships in the order of their names in `starts_m`.

        Raises:
            ValueError: There are fewer places than ships.
        """
        from groundstation.control.trajectories import Reconfiguration

        return Reconfiguration(
            tuple(self.starts_m.values()),
            tuple(self.places_m[number] for number in self.assigned().values()),
            keep_in,
            self.obstacles_m,
            self.margins(),
            self.duration_s,
        )

    def margins(self) -> "Margins":
        """What every plan keeps to."""
        from groundstation.control.trajectories import Margins

        return Margins(
            gap_m=self.gap_m,
            stopping_gap_m=min(_STOPPING_GAP_M, self.gap_m),
            edge_gap_m=_STOPPING_GAP_M,
            speed_m_s=self.speed_m_s,
            acceleration_m_s2=self.acceleration_m_s2,
            braking_m_s2=self.braking_m_s2,
            reaction_s=FILTER.reaction_s + FILTER.reserve_s + 1.0 / FILTER.gain_per_s,
        )
