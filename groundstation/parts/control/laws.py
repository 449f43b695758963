"""The control law of a vehicle: the one that its rig names, and those that it is changed to while it runs."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from groundstation.control.controller import Controller
from groundstation.control.controllers import ControllerRow, controllers, make_controller
from groundstation.control.follow import FollowConfig
from groundstation.declarations.rig import Rig
from groundstation.declarations.validation import message_of
from groundstation.parts.control.sections import ControlSection, config_of, control_of, dockings_of
from groundstation.parts.relative_navigation.sections import RelativeNavigationOfVehicle

HOLDING = "go_to"
"""The controller that flies where a program is interrupted."""


@dataclass(frozen=True, slots=True, eq=False)
class Law:
    """A control law, ready to fly.

    Attributes:
        name: A row of the table of controllers.
        controller: The law.
        holding: Flies to the goal and holds it while the law's own program is interrupted; None where the law
            has no program and follows the goal itself.
        neighbours: Other vehicles whose states it wants.
        led_by: Those of them without whom it has no place of its own.
    """

    name: str
    controller: Controller
    holding: Controller | None = None
    neighbours: tuple[str, ...] = ()
    led_by: tuple[str, ...] = ()

    @property
    def to_goal(self) -> Controller:
        """What flies to a goal, and waits there until the law's own program is resumed."""
        return self.holding or self.controller


Maker = Callable[[str, Mapping[str, Any]], Law]
"""Makes a law of a controller's name and parameters; ValueError in a sentence where it cannot be flown."""


def row_of(rig: Rig, vehicle: str) -> ControllerRow[Any]:
    """The row of the controller that the rig names for a vehicle."""
    return controllers()[control_of(rig, vehicle)[0].controller]


def law_of(rig: Rig, vehicle: str, section: ControlSection, key: str) -> Law:
    """The law that a section of the rig describes.

    Args:
        rig: The rig.
        vehicle: Whom it flies.
        section: Its controller and parameters.
        key: Of the section, for sentences.

    Raises:
        ValueError: One sentence with the key: what is unknown, missing or out of range.
    """
    check_name(section.controller, key)
    row = controllers()[section.controller]
    try:
        config = config_of(rig, vehicle, section)
    except ValidationError as error:
        raise ValueError(f"{key}.parameters{_first(error)}") from error
    neighbours = tuple(row.neighbours(config))
    for neighbour in neighbours:
        if neighbour == vehicle or neighbour not in rig.vehicles:
            others = ", ".join(other for other in rig.vehicles if other != vehicle) or "none"
            raise ValueError(
                f"{key}.parameters: {neighbour!r} is no other vehicle of the rig (there are: {others})"
            )
    _check_heading(rig, vehicle, config, neighbours)
    model, keep_in = rig.type_of(vehicle).model(), rig.table.keep_in()
    try:
        law = row.make(config, model, keep_in)
    except ValueError as error:
        raise ValueError(f"{key}.parameters: {error}") from error
    holding = make_controller(HOLDING, {}, model, keep_in) if row.has_program else None
    return Law(section.controller, law, holding, neighbours, tuple(row.led_by(config)))


def _check_heading(rig: Rig, vehicle: str, config: BaseModel, neighbours: tuple[str, ...]) -> None:
    """Of a neighbour that is seen by its lit part no law may want to know how it is turned.

    Raises:
        ValueError: The law does, or nobody knows whether it does.
    """
    keys = rig.vehicle(vehicle, RelativeNavigationOfVehicle)
    seen = keys.leader_seen()
    if seen not in neighbours or keys.side_camera is None or keys.side_camera.by != "lit_part":
        return
    if not isinstance(config, FollowConfig) or config.bearing == "leader":
        raise ValueError(
            f"vehicles.{vehicle}.leader_by: the lit part of {seen} does not tell how it is turned, which "
            "this controller needs: find it by its markers"
        )


def maker_of(rig: Rig, vehicle: str) -> Maker:
    """What makes the laws that a vehicle can be changed to while it runs."""

    def make(controller: str, parameters: Mapping[str, Any]) -> Law:
        check_name(controller, "change_controller")
        row = controllers()[controller]
        if not row.is_built_in:
            raise ValueError(
                f"{controller} comes from a package and has a process of its own: name it in the rig"
            )
        if row.is_planned_together:
            raise ValueError(f"{controller} plans for all ships before they fly: name it in the rig")
        try:
            section = ControlSection(controller=controller, parameters=dict(parameters))
        except ValidationError as error:
            raise ValueError(f"change_controller{_first(error)}") from error
        law = law_of(rig, vehicle, section, "change_controller")
        touches = row.docks_with(config_of(rig, vehicle, section))
        if touches is not None and (vehicle, *touches) not in dockings_of(rig):
            raise ValueError(
                f"the rig lets {vehicle} touch {touches[0]} in no such corridor: name the docking in the rig"
            )
        return law

    return make


def check_name(controller: str, key: str) -> None:
    """A controller's name.

    Raises:
        ValueError: There is no controller of that name.
    """
    if controller not in controllers():
        known = ", ".join(sorted(controllers()))
        raise ValueError(f"{key}: controller {controller!r:.40} is none of {known}")


def _first(error: ValidationError) -> str:
    first = error.errors()[0]
    where = "".join(f".{step}" for step in first["loc"])  # nowhere: the parameters as a whole
    if not where:
        return f": {message_of(first)}"
    if first["type"] == "extra_forbidden":
        return f"{where}: is no parameter of this controller (a typo?)"
    return f"{where}: {message_of(first)}, found {first['input']!r:.60}"


def parameters_of(text: str) -> dict[str, Any]:
    """Parameters of a controller.

    Raises:
        ValueError: They are no JSON object.
    """
    try:
        given = json.loads(text, parse_constant=_refuse)
    except _NoNumberError as error:
        raise ValueError(f"change_controller: the parameters hold {error}, expected finite numbers") from None
    except (ValueError, RecursionError):
        given = None
    if not isinstance(given, dict):
        raise ValueError("change_controller: the parameters are no JSON object")
    return given


class _NoNumberError(Exception):
    """What JSON has no word for, and Python's reader takes."""


def _refuse(word: str) -> None:
    raise _NoNumberError(word)
