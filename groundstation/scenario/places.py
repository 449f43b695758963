"""Where mock-ups stand and are sent: on the table, apart from each other, free of obstacles."""

import itertools
import math

from groundstation.declarations.rig import MOCK_UP_RADIUS_M, HoldSection, Rig
from groundstation.scenario.key_trouble import KeyTroubleError
from groundstation.scenario.scenario_file import Obstacle, ScenarioFile
from groundstation.supervision.apart import too_near


def check_places(file: ScenarioFile, rig: Rig) -> None:
    """Starts are on the table, apart from each other and from obstacles."""
    for number, obstacle in enumerate(file.obstacles):
        table = rig.table
        if not (
            table.x_min_m <= obstacle.x_m <= table.x_max_m and table.y_min_m <= obstacle.y_m <= table.y_max_m
        ):
            raise KeyTroubleError(
                f"obstacles.{number}: ({obstacle.x_m:g}, {obstacle.y_m:g}) m is off the table"
            )
    starts = {name: (_start_key(file, name), rig.vehicles[name].hold) for name in rig.vehicles}
    for key, hold in starts.values():
        refusal = off_place(hold.x_m, hold.y_m, rig, file.obstacles)
        if refusal:
            raise KeyTroubleError(f"{key}: {refusal}")
    for (name, (_, hold)), (_, (key, its)) in itertools.combinations(starts.items(), 2):
        apart_m = math.dist((hold.x_m, hold.y_m), (its.x_m, its.y_m))
        refusal = too_near(f"the start of {name}", apart_m, relation="from there")
        if refusal:
            raise KeyTroubleError(f"{key}: {refusal}")


def _start_key(file: ScenarioFile, vehicle: str) -> str:
    """The key of a vehicle's start: the scenario's, or the rig's pose to hold."""
    keys = file.vehicles.get(vehicle)
    return f"vehicles.{vehicle}.{'hold' if keys is None or keys.start is None else 'start'}"


def check_starts(file: ScenarioFile, rig: Rig) -> None:
    """Starts of the scenario are on the table, in its own words before the rig's."""
    for name, keys in file.vehicles.items():
        start: HoldSection | None = keys.start
        if start is not None and not rig.table.holds(start.x_m, start.y_m):
            raise KeyTroubleError(f"vehicles.{name}.start: {_off_table(start.x_m, start.y_m)}")


def _off_table(x_m: float, y_m: float) -> str:
    return f"({x_m:g}, {y_m:g}) m is nearer than {MOCK_UP_RADIUS_M:g} m to the table's edge, or beyond it"


def off_place(x_m: float, y_m: float, rig: Rig, obstacles: tuple[Obstacle, ...]) -> str:
    """Why a mock-up cannot be at a place; empty if it can."""
    if not rig.table.holds(x_m, y_m):
        return _off_table(x_m, y_m)
    for obstacle in obstacles:
        room_m = math.dist((x_m, y_m), (obstacle.x_m, obstacle.y_m)) - obstacle.radius_m - MOCK_UP_RADIUS_M
        if room_m < 0.0:
            return (
                f"({x_m:g}, {y_m:g}) m is on the obstacle at ({obstacle.x_m:g}, {obstacle.y_m:g}) m: "
                f"{-room_m:.2f} m farther away would be free"
            )
    return ""
