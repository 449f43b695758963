"""From a scenario file to the rig that flies it: starts, controllers, the timeline as its player reads it.

Everything that can be known before anything moves is checked here; each mistake is one sentence with file,
key and what was expected.
"""

import itertools
import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

from groundstation.control.controllers import controllers
from groundstation.declarations.request import Action, ArgumentError
from groundstation.declarations.rig import MOCK_UP_RADIUS_M, HoldSection, Rig
from groundstation.parts.control.actions import GO_TO
from groundstation.parts.control.sections import control_of, neighbours_of
from groundstation.parts.laboratory.failure_desk import INJECT
from groundstation.parts.scenario.conditions import (
    SETTLED,
    SETTLED_FOR_NS,
    Condition,
    ConditionError,
    plain,
    read_condition,
)
from groundstation.parts.scenario.part import bounds_of
from groundstation.parts.supervision.sections import SupervisionOfVehicle
from groundstation.rig.variation import varied
from groundstation.scenario.scenario_file import ALL, FOLLOWERS, Limit, Obstacle, Row, ScenarioFile
from groundstation.supervision.apart import too_near

Changes = dict[str, Any]
Groups = Mapping[str, tuple[str, ...]]


OWN_SECTION = "scenario"


class KeyTroubleError(ValueError):
    """What is wrong with a scenario; the text begins with the key."""


def compiled_rig(file: ScenarioFile, rig: Rig, *, is_hardware: bool = False) -> Rig:
    """The rig that flies a scenario.

    Args:
        file: The scenario.
        rig: The one that it names, or the hardware that it is to fly on.
        is_hardware: Starts are gone to before t = 0; the laboratory's keys are left out.

    Raises:
        KeyTroubleError: The scenario does not fit the rig.
        RigError: The rig refuses what the scenario changes.
    """
    for name in file.vehicles:
        if name not in rig.vehicles:
            raise KeyTroubleError(f"vehicles.{name}: the rig has no such vehicle (it has: {_listed(rig)})")
    _check_starts(file, rig)
    changed = varied(rig, _changes(file, rig, is_hardware=is_hardware))
    _check_places(file, changed)
    groups = groups_of(changed)
    starters = tuple(name for name in changed.vehicles if _starts_by_itself(changed, name))
    if not starters:
        raise KeyTroubleError("rig: none of its vehicles starts by itself, so t = 0 would never come")
    section: Changes = {
        "name": file.name,
        "ready_s": file.ready_s,
        "duration_s": file.duration_s,
        "starters": list(starters),
        "settle_first": is_hardware,
        "resumed": [name for name in starters if _has_program(changed, name)],
        "timeline": list(_rows(file, changed, groups)),
    }
    return varied(changed, {OWN_SECTION: section})


def groups_of(rig: Rig) -> dict[str, tuple[str, ...]]:
    """Vehicles by the word for them: each by its name, ``all``, ``followers``."""
    groups = {name: (name,) for name in rig.vehicles}
    followers = tuple(name for name in rig.vehicles if neighbours_of(rig, name))
    return {**groups, ALL: tuple(rig.vehicles), FOLLOWERS: followers}


def expanded(limit: Limit, number: int, groups: Groups) -> list[tuple[str, ...]]:
    """Vehicles, or pairs of them, that a limit holds for.

    Raises:
        KeyTroubleError: It names a vehicle that is not there.
    """
    key = f"limits.{number}"
    if limit.vehicles is not None:
        names = [name for word in limit.vehicles for name in _members(f"{key}.vehicles", word, groups)]
        return list(itertools.combinations(dict.fromkeys(names), 2)) if len(names) > 1 else [(names[0],)]
    assert limit.vehicle is not None
    return [(name,) for name in _members(f"{key}.vehicle", limit.vehicle, groups)]


def _changes(file: ScenarioFile, rig: Rig, *, is_hardware: bool) -> Changes:
    changes: Changes = {}
    for key, value in file.changes.items():
        if key.partition(".")[0] == OWN_SECTION:
            raise KeyTroubleError(f"changes.{key}: '{OWN_SECTION}' is what the timeline is written into")
        if not (is_hardware and key.startswith("laboratory.")):
            changes[key] = value
    for name, keys in file.vehicles.items():
        if keys.start is not None:
            changes[f"vehicles.{name}.hold"] = keys.start.model_dump()
        if keys.control is not None:
            changes[f"vehicles.{name}.control"] = keys.control.model_dump()
        if is_hardware or rig.laboratory is None:
            continue
        if keys.start is not None:
            changes[f"laboratory.{name}.start_m"] = [keys.start.x_m, keys.start.y_m]
            changes[f"laboratory.{name}.start_heading_deg"] = keys.start.heading_deg
        changes |= dict(_leaves(f"laboratory.{name}", keys.laboratory))
    for name in rig.vehicles:  # programs begin at t = 0, whoever chose them
        keys_of = file.vehicles.get(name)
        if keys_of is not None and keys_of.control is not None:
            changes[f"vehicles.{name}.control"]["waits"] = True
        else:
            section = control_of(rig, name)[0]
            changes[f"vehicles.{name}.control"] = {**section.model_dump(), "waits": True}
    return changes


def _leaves(key: str, table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Values of nested tables by their keys: what a table leaves out stays as it is."""
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(f"{key}.{name}", value)
        else:
            yield f"{key}.{name}", value


def _starts_by_itself(rig: Rig, vehicle: str) -> bool:
    return rig.vehicle(vehicle, SupervisionOfVehicle).starts_by_itself


def _has_program(rig: Rig, vehicle: str) -> bool:
    return controllers()[control_of(rig, vehicle)[0].controller].has_program


# -- places ---------------------------------------------------------------------------------------------


def _check_places(file: ScenarioFile, rig: Rig) -> None:
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
        refusal = _off_place(hold.x_m, hold.y_m, rig, file.obstacles)
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


def _check_starts(file: ScenarioFile, rig: Rig) -> None:
    """Starts of the scenario are on the table, in its own words before the rig's."""
    for name, keys in file.vehicles.items():
        start: HoldSection | None = keys.start
        if start is not None and not rig.table.holds(start.x_m, start.y_m):
            raise KeyTroubleError(f"vehicles.{name}.start: {_off_table(start.x_m, start.y_m)}")


def _off_table(x_m: float, y_m: float) -> str:
    return f"({x_m:g}, {y_m:g}) m is nearer than {MOCK_UP_RADIUS_M:g} m to the table's edge, or beyond it"


def _off_place(x_m: float, y_m: float, rig: Rig, obstacles: tuple[Obstacle, ...]) -> str:
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


# -- the timeline ---------------------------------------------------------------------------------------


def _rows(file: ScenarioFile, rig: Rig, groups: Groups) -> Iterator[Changes]:
    earliest_s = 0.0
    for number, row in enumerate(file.timeline):
        key = f"timeline.{number}"
        made: Changes = {"where": key}
        if row.when is None:
            assert row.at_s is not None
            made["at_s"] = earliest_s = row.at_s
        else:
            condition = _condition(row, key, rig, groups)
            earliest_s += row.after_s + (SETTLED_FOR_NS * 1e-9 if _needs_settling(condition) else 0.0)
            if earliest_s > file.duration_s:
                raise KeyTroubleError(
                    f"{key}.when: {row.when!r} cannot come true before the end: not before {earliest_s:g} s, "
                    f"duration_s = {file.duration_s:g}"
                )
            made |= {"when": plain(condition), "timeout_s": row.timeout_s, "after_s": row.after_s}
        if row.mark is not None:
            made["mark"] = row.mark
        else:
            assert row.vehicle is not None
            vehicles = _members(f"{key}.vehicle", row.vehicle, groups)
            action, arguments = _asked(row, key, rig, file)
            made |= {"vehicles": list(vehicles), "action": action, "arguments": json.dumps(arguments)}
            made["answer"] = row.answer
        yield made


def _condition(row: Row, key: str, rig: Rig, groups: Groups) -> Condition:
    assert row.when is not None
    assert row.timeout_s is not None
    try:
        condition = read_condition(row.when, groups, bounds_of(rig))
    except ConditionError as error:
        raise KeyTroubleError(f"{key}.when: {error}") from error
    if _needs_settling(condition) and row.timeout_s <= SETTLED_FOR_NS * 1e-9:
        raise KeyTroubleError(
            f"{key}.timeout_s: {row.timeout_s:g} s is too short, a vehicle has settled after "
            f"{SETTLED_FOR_NS * 1e-9:g} s at the earliest"
        )
    return condition


def _needs_settling(condition: Condition) -> bool:
    return any(term.flag == SETTLED for term in condition.terms)


def _asked(row: Row, key: str, rig: Rig, file: ScenarioFile) -> tuple[str, dict[str, Any]]:
    """Action and arguments, in radians."""
    if row.failure is not None:
        parameters = json.dumps(row.parameters)
        try:
            given = INJECT.check({"failure": row.failure, "for_s": row.for_s, "parameters": parameters})
        except ArgumentError as error:
            raise KeyTroubleError(f"{key}: {error}") from error
        return INJECT.name, dict(given)
    assert row.request is not None
    actions = rig.tables.actions
    if row.request not in actions or row.request == INJECT.name:
        known = ", ".join(sorted(set(actions) - {INJECT.name}))
        raise KeyTroubleError(f"{key}.request: {row.request!r} is no action (there are: {known})")
    given = _arguments(actions[row.request], row, key)
    if row.request == GO_TO.name and row.answer == "accepted":
        refusal = _off_place(float(given["x_m"]), float(given["y_m"]), rig, file.obstacles)
        if refusal:
            raise KeyTroubleError(f"{key}.arguments: {refusal}")
    return row.request, given


def _arguments(action: Action, row: Row, key: str) -> dict[str, Any]:
    """By the action's own names: files speak degrees."""
    in_file = {
        f"{argument.name.removesuffix('_rad')}_deg": argument.name
        for argument in action.arguments
        if argument.name.endswith("_rad")
    }
    given: dict[str, Any] = {}
    for name, value in row.arguments.items():
        if name in in_file and isinstance(value, int | float) and not isinstance(value, bool):
            given[in_file[name]] = math.radians(value)
        else:
            given[name] = value
    try:
        return dict(action.check(given))
    except ArgumentError as error:
        raise KeyTroubleError(f"{key}.arguments: {str(error).replace('_rad', '_deg')}") from error


def _members(key: str, word: str, groups: Groups) -> tuple[str, ...]:
    if word not in groups:
        raise KeyTroubleError(f"{key}: {word!r} is no vehicle of the rig (there are: {', '.join(groups)})")
    if not groups[word]:
        raise KeyTroubleError(f"{key}: {word!r} are none here, no vehicle follows another")
    return groups[word]


def _listed(rig: Rig) -> str:
    return ", ".join(rig.vehicles)
