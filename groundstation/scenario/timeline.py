"""The timeline of a scenario file as its player reads it: groups and degrees resolved, all of it checked."""

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

from groundstation.declarations.request import Action, ArgumentError
from groundstation.declarations.rig import Rig
from groundstation.parts.control.actions import GO_TO
from groundstation.parts.laboratory.failure_desk import INJECT
from groundstation.parts.scenario.condition_text import ConditionError, plain, read_condition
from groundstation.parts.scenario.conditions import SETTLED, SETTLED_FOR_NS, Condition
from groundstation.parts.scenario.part import bounds_of
from groundstation.scenario.key_trouble import KeyTroubleError
from groundstation.scenario.places import off_place
from groundstation.scenario.scenario_file import Row, ScenarioFile

Changes = dict[str, Any]
Groups = Mapping[str, tuple[str, ...]]


def timeline_rows(file: ScenarioFile, rig: Rig, groups: Groups) -> Iterator[Changes]:
    """The rows of the player's section, each as its keys.

    Raises:
        KeyTroubleError: A row asks for what is not there, or can never come.
    """
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
            if row.vehicle is not None:
                members(f"{key}.vehicle", row.vehicle, groups)
        else:
            assert row.vehicle is not None
            vehicles = members(f"{key}.vehicle", row.vehicle, groups)
            action, arguments = _asked(row, key, rig, file, vehicles)
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


def _asked(
    row: Row, key: str, rig: Rig, file: ScenarioFile, vehicles: tuple[str, ...]
) -> tuple[str, dict[str, Any]]:
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
        if len(vehicles) > 1:
            raise KeyTroubleError(f"{key}.arguments: {' and '.join(vehicles)} cannot be sent to one place")
        refusal = off_place(float(given["x_m"]), float(given["y_m"]), rig, file.obstacles)
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
        if name in in_file.values():
            raise KeyTroubleError(f"{key}.arguments: {name!r} is in degrees here: {name[:-4]}_deg")
        if name in in_file and isinstance(value, int | float) and not isinstance(value, bool):
            value = math.radians(value)
        given[in_file.get(name, name)] = value
    try:
        return dict(action.check(given))
    except ArgumentError as error:
        raise KeyTroubleError(f"{key}.arguments: {str(error).replace('_rad', '_deg')}") from error


def members(key: str, word: str, groups: Groups) -> tuple[str, ...]:
    """Vehicles that a word stands for.

    Raises:
        KeyTroubleError: It stands for none.
    """
    if word not in groups:
        raise KeyTroubleError(f"{key}: {word!r} is no vehicle of the rig (there are: {', '.join(groups)})")
    if not groups[word]:
        raise KeyTroubleError(f"{key}: {word!r} are none here, no vehicle follows another")
    return groups[word]
