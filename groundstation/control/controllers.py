"""The table of controllers: those of the tree, then those of installed packages.

A new one is a file and a row here, or a row of another package under the entry point group
``groundstation.controllers``; the contract tests find the row.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from pydantic import BaseModel

from groundstation.control.controller import Controller
from groundstation.control.corridor import Corridor
from groundstation.control.dock import Dock, DockConfig
from groundstation.control.follow import Follow, FollowConfig
from groundstation.control.formation import Formation, FormationConfig
from groundstation.control.go_to import GoTo, GoToConfig
from groundstation.control.keep_in import KeepIn
from groundstation.control.path import PathConfig, PathFollowing
from groundstation.control.state import Vector2
from groundstation.control.station import StationConfig, StationKeeping
from groundstation.control.trajectory import Trajectory
from groundstation.control.trajectory_config import TrajectoryConfig
from groundstation.control.tumble import Tumble, TumbleConfig
from groundstation.control.vehicle import VehicleModel

ENTRY_POINT_GROUP = "groundstation.controllers"
ConfigT = TypeVar("ConfigT", bound=BaseModel)


class ControllerError(ValueError):
    """A controller of an installed package cannot be used; the text is one sentence."""


def _nobody(config: BaseModel) -> tuple[str, ...]:
    del config
    return ()


def _with_nobody(config: BaseModel) -> tuple[str, Corridor] | None:
    del config
    return None


Obstacles = tuple[tuple[float, float, float], ...]
"""x, y, radius (m) of each."""


def _nothing(vehicle: str, fleet_m: Mapping[str, Vector2], obstacles_m: Obstacles) -> Mapping[str, Any]:
    del vehicle, fleet_m, obstacles_m
    return {}


@dataclass(frozen=True, slots=True)
class ControllerRow(Generic[ConfigT]):
    """One controller.

    Attributes:
        summary: What it does, for menus.
        config: Model of its parameters; validation names the wrong key.
        make: Builds one for a vehicle.
        example: Parameters that the contract tests run it with.
        neighbours: Other vehicles whose states it wants, by its parameters.
        of_rig: Parameters that the rig states already, from its name, the places to hold of all that
            fly this law, and the places to keep out of; the file's own go before them.
        led_by: Those of them without whom it has no place of its own, by its parameters.
        docks_with: Whom it may touch and in which corridor, by its parameters; None where nobody.
        has_program: It knows by itself where to go; a goal interrupts it until it is resumed.
        is_planned_together: It plans for all ships before they fly, so that none changes to it in flight.
        is_built_in: It is of the tree; others run in a process of their own.
    """

    summary: str
    config: type[ConfigT]
    make: Callable[[ConfigT, VehicleModel, KeepIn | None], Controller]
    example: Mapping[str, Any] = field(default_factory=dict)
    neighbours: Callable[[ConfigT], tuple[str, ...]] = _nobody
    led_by: Callable[[ConfigT], tuple[str, ...]] = _nobody
    of_rig: Callable[[str, Mapping[str, Vector2], Obstacles], Mapping[str, Any]] = _nothing
    docks_with: Callable[[ConfigT], tuple[str, Corridor] | None] = _with_nobody
    has_program: bool = False
    is_planned_together: bool = False
    is_built_in: bool = False

    def build(
        self, parameters: Mapping[str, Any], vehicle: VehicleModel, keep_in: KeepIn | None
    ) -> Controller:
        """A controller from the parameters of a rig file.

        Raises:
            pydantic.ValidationError: A parameter is unknown, missing or out of range.
        """
        return self.make(self.config.model_validate(dict(parameters)), vehicle, keep_in)


_BUILT_IN: Mapping[str, ControllerRow[Any]] = MappingProxyType(
    {
        "station": ControllerRow(
            "hold the goal pose",
            StationConfig,
            lambda config, vehicle, _keep_in: StationKeeping(config, vehicle),
        ),
        "go_to": ControllerRow("travel to the goal pose within limits, then hold it", GoToConfig, GoTo),
        "formation": ControllerRow(
            "hold a pose relative to other mock-ups",
            FormationConfig,
            Formation,
            {"neighbours": {"leader": {"offset_m": (-0.6, 0.0)}}, "goal_weight": 1.0},
            lambda config: tuple(config.neighbours),
            led_by=lambda config: () if config.goal_weight else tuple(config.neighbours),
        ),
        "path": ControllerRow(
            "follow waypoints, the perimeter or a figure eight",
            PathConfig,
            PathFollowing,
            {"waypoints_m": ((0.3, 0.0), (0.3, 0.3))},
            has_program=True,
        ),
        "tumble": ControllerRow(
            "play a target that nobody controls: it turns and drifts",
            TumbleConfig,
            Tumble,
            {"mode": "free", "span_s": 20.0},
            has_program=True,
        ),
        "follow": ControllerRow(
            "keep a distance to a leader, and face it",
            FollowConfig,
            Follow,
            {"leader": "leader", "distance_m": 0.8},
            lambda config: (config.leader,),
            led_by=lambda config: (config.leader,),
            has_program=True,
        ),
        "trajectory": ControllerRow(
            "reconfigure: fly the own part of a plan on which nobody meets",
            TrajectoryConfig,
            Trajectory,
            {
                "ship": "own",
                "starts_m": {"own": (0.0, 0.0), "leader": (1.2, 0.0)},
                "places_m": ((1.2, 0.0), (0.0, 0.0)),
            },
            lambda config: tuple(name for name in config.starts_m if name != config.ship),
            of_rig=lambda vehicle, fleet_m, obstacles_m: {
                "ship": vehicle,
                "starts_m": fleet_m,
                "obstacles_m": obstacles_m,
            },
            has_program=True,
            is_planned_together=True,
        ),
        "dock": ControllerRow(
            "come in along the corridor of another mock-up's port to a soft contact",
            DockConfig,
            Dock,
            {"target": "leader"},
            lambda config: (config.target,),
            led_by=lambda config: (config.target,),
            docks_with=lambda config: (config.target, config.corridor()),
            has_program=True,
        ),
    }
)


@cache
def controllers() -> Mapping[str, ControllerRow[Any]]:
    """Every controller by the rig's word for it.

    Raises:
        ControllerError: One of an installed package cannot be loaded, or takes a name that is in use.
    """
    rows = {name: replace(row, is_built_in=True) for name, row in _BUILT_IN.items()}
    for point in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda point: point.name):
        if point.name in rows:
            raise ControllerError(f"{_where(point)} takes a name that is in use")
        rows[point.name] = _load(point)
    return MappingProxyType(rows)


def _where(point: EntryPoint) -> str:
    package = point.dist.name if point.dist is not None else point.module
    return f"the controller {point.name!r} of the package {package} ({point.value})"


def _load(point: EntryPoint) -> ControllerRow[Any]:
    where = _where(point)
    try:
        row = point.load()
    except (Exception, SystemExit) as error:  # whatever a package of somebody else raises: it is named, once
        raise ControllerError(f"{where} cannot be loaded: {type(error).__name__}: {error}") from error
    if not isinstance(row, ControllerRow):
        raise ControllerError(f"{where} is a {type(row).__name__}, expected a ControllerRow")
    return replace(row, is_built_in=False)


def make_controller(
    name: str,
    parameters: Mapping[str, Any],
    vehicle: VehicleModel,
    keep_in: KeepIn | None = None,
) -> Controller:
    """The named controller.

    Raises:
        ValueError: No controller has that name, or a parameter is wrong (pydantic names the key).
    """
    known = controllers()
    if name not in known:
        raise ValueError(f"no controller is called {name!r}; there are {', '.join(sorted(known))}")
    return known[name].build(parameters, vehicle, keep_in)
