"""THE TABLE of controllers: a new one is a file and a row here; the contract tests find the row."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from pydantic import BaseModel

from groundstation.control.controller import Controller
from groundstation.control.formation import Formation, FormationConfig
from groundstation.control.go_to import GoTo, GoToConfig
from groundstation.control.keep_in import KeepIn
from groundstation.control.station import StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel

ConfigT = TypeVar("ConfigT", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class ControllerRow(Generic[ConfigT]):
    """One controller.

    Attributes:
        summary: What it does, for menus.
        config: Model of its settings; validation names the wrong key.
        make: Builds one for a vehicle.
        example: Settings that the contract tests run it with.
    """

    summary: str
    config: type[ConfigT]
    make: Callable[[ConfigT, VehicleModel, KeepIn | None], Controller]
    example: Mapping[str, Any]

    def build(self, settings: Mapping[str, Any], vehicle: VehicleModel, keep_in: KeepIn | None) -> Controller:
        """A controller from the settings of a rig file.

        Raises:
            pydantic.ValidationError: A setting is unknown, missing or out of range.
        """
        return self.make(self.config.model_validate(dict(settings)), vehicle, keep_in)


CONTROLLERS: Mapping[str, ControllerRow[Any]] = {
    "station": ControllerRow(
        "hold the goal pose",
        StationConfig,
        lambda config, vehicle, _keep_in: StationKeeping(config, vehicle),
        {},
    ),
    "go_to": ControllerRow("travel to the goal pose within limits, then hold it", GoToConfig, GoTo, {}),
    "formation": ControllerRow(
        "hold a pose relative to other mock-ups",
        FormationConfig,
        Formation,
        {"neighbours": {"leader": {"offset_m": (-0.6, 0.0)}}, "goal_weight": 1.0},
    ),
}


def make_controller(
    name: str,
    settings: Mapping[str, Any],
    vehicle: VehicleModel,
    keep_in: KeepIn | None = None,
) -> Controller:
    """The named controller.

    Raises:
        ValueError: No controller has that name, or a setting is wrong (pydantic names the key).
    """
    if name not in CONTROLLERS:
        raise ValueError(f"no controller is called {name!r}; there are {', '.join(sorted(CONTROLLERS))}")
    return CONTROLLERS[name].build(settings, vehicle, keep_in)
