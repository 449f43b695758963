"""What a screen has to know of a rig before it draws anything; sent once."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from groundstation.control.controllers import controllers
from groundstation.declarations.request import Action, Argument
from groundstation.declarations.rig import MOCK_UP_RADIUS_M, Rig
from groundstation.parts.control.sections import control_of, neighbours_of
from groundstation.parts.scenario.sections import ScenarioOfRig
from groundstation.parts.stars.sections import StarsOfType
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.rays import ceiling_points
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.supervision.faults import FAULTS

EDGE_POINTS = 6
"""Of each side of a camera's picture, carried to the ceiling: a lens bends it."""


def rig_page(rig: Rig) -> dict[str, Any]:
    """The rig as JSON: table, vehicles, stars, actions, controllers, faults; SI and radians."""
    table, scenario = rig.table, rig.section(ScenarioOfRig).scenario
    return {
        "name": rig.name,
        "is_emulated": rig.laboratory is not None,
        "starts_by_hand": scenario is not None and scenario.by_hand,
        "table": {
            "x_m": [table.x_min_m, table.x_max_m],
            "y_m": [table.y_min_m, table.y_max_m],
            "keep_out": [
                {"name": place.name, "x_m": place.x_m, "y_m": place.y_m, "radius_m": place.radius_m}
                for place in table.keep_out
            ],
            "has_map": table.map is not None,
            "pull": _pull(rig),
        },
        "vehicles": {name: _vehicle(rig, name) for name in rig.vehicles},
        "actions": {name: _action(action) for name, action in rig.tables.actions.items()},
        "controllers": {
            name: {
                "summary": row.summary,
                "parameters": _schema(row.config),
                "has_program": row.has_program,
                "can_be_chosen": row.is_built_in and not row.is_planned_together,
            }
            for name, row in sorted(controllers().items())
        },
        "faults": {
            fault.id: {"what": fault.what, "found_by": fault.found_by, "advice": fault.advice}
            for fault in FAULTS.values()
        },
    }


def _vehicle(rig: Rig, name: str) -> dict[str, Any]:
    type_ = rig.type_of(name)
    hold, section = rig.vehicles[name].hold, control_of(rig, name)[0]
    return {
        "type": rig.vehicles[name].mock_up,
        "radius_m": MOCK_UP_RADIUS_M,
        "valves": [asdict(valve) for valve in type_.model().valves],
        "hold": {"x_m": hold.x_m, "y_m": hold.y_m, "heading_rad": math.radians(hold.heading_deg)},
        "controller": section.controller,
        "parameters": dict(section.parameters),
        "neighbours": list(neighbours_of(rig, name)),
        "stars": _sky(rig, name),
    }


def _sky(rig: Rig, name: str) -> dict[str, Any] | None:
    """Stars of the ceiling, and the outline on it of what the camera sees, from the body at heading 0."""
    camera = rig.of_type(name, StarsOfType).star_camera
    if camera is None:
        return None
    catalogue = camera.ceiling.value(StarCatalogue.parse)
    lens = camera.camera.value(CameraCalibration.parse)
    u_px, v_px = _outline_px(lens.width, lens.height)
    seen_m, _ = ceiling_points(lens, u_px, v_px)
    return {
        "places_m": np.column_stack((catalogue.x_m, catalogue.y_m)).tolist(),
        "view_body_m": seen_m.tolist(),
        "width_px": lens.width,
        "height_px": lens.height,
    }


def _outline_px(width: int, height: int) -> tuple[Any, Any]:
    along = np.linspace(0.0, 1.0, EDGE_POINTS, endpoint=False)
    zero, one = np.zeros(EDGE_POINTS), np.ones(EDGE_POINTS)
    u = np.concatenate((along, one, 1.0 - along, zero)) * (width - 1)
    v = np.concatenate((zero, along, one, 1.0 - along)) * (height - 1)
    return u, v


def _pull(rig: Rig) -> dict[str, Any] | None:
    """The map of the table's pull on a grid, where the rig has one."""
    grid = rig.table.slope_grid()
    if grid is None:
        return None
    x_m = np.linspace(rig.table.x_min_m, rig.table.x_max_m, 13)
    y_m = np.linspace(rig.table.y_min_m, rig.table.y_max_m, 9)
    rows = [[*map(float, grid.at(float(x), float(y)))] for y in y_m for x in x_m]
    return {"x_m": x_m.tolist(), "y_m": y_m.tolist(), "pull_m_s2": rows}


def _action(action: Action) -> dict[str, Any]:
    return {
        "summary": action.summary,
        "answered_by": action.answered_by,
        "arguments": [_argument(argument) for argument in action.arguments],
    }


def _argument(argument: Argument) -> dict[str, Any]:
    return {
        "name": argument.name,
        "summary": argument.summary,
        "kind": argument.kind.__name__,
        "low": argument.low if math.isfinite(argument.low) else None,
        "high": argument.high if math.isfinite(argument.high) else None,
        "default": argument.default,
    }


def _schema(config: Any) -> Mapping[str, Any]:  # noqa: ANN401 a class of pydantic's, of somebody's package
    return {
        name: {"default": None if field.is_required() else repr(field.default), "about": field.description}
        for name, field in config.model_fields.items()
    }
