"""From a scenario file to the rig that flies it: starts, controllers, the timeline as its player reads it.

Everything that can be known before anything moves is checked here; each mistake is one sentence with file,
key and what was expected.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from groundstation.control.controllers import controllers
from groundstation.declarations.rig import Rig
from groundstation.parts.control.sections import control_of, neighbours_of
from groundstation.parts.supervision.sections import SupervisionOfVehicle
from groundstation.rig.variation import varied
from groundstation.scenario.key_trouble import KeyTroubleError
from groundstation.scenario.places import check_places, check_starts
from groundstation.scenario.scenario_file import ALL, FOLLOWERS, ScenarioFile
from groundstation.scenario.timeline import Changes, timeline_rows

OWN_SECTION = "scenario"
STARTS = ("start_m", "start_heading_deg")
"""Where a vehicle of the emulated laboratory stands at first."""


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
    check_starts(file, rig)
    _check_changes(file, rig)
    changed = varied(rig, _changes(file, rig, is_hardware=is_hardware))
    check_places(file, changed)
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
        "timeline": list(timeline_rows(file, changed, groups)),
    }
    return varied(changed, {**_waiting(changed), OWN_SECTION: section})


def groups_of(rig: Rig) -> dict[str, tuple[str, ...]]:
    """Vehicles by the word for them: each by its name, ``all``, ``followers``."""
    groups = {name: (name,) for name in rig.vehicles}
    followers = tuple(name for name in rig.vehicles if neighbours_of(rig, name))
    return {**groups, ALL: tuple(rig.vehicles), FOLLOWERS: followers}


def _check_changes(file: ScenarioFile, rig: Rig) -> None:
    """What would change nothing, or more than is meant, is a mistake.

    Raises:
        KeyTroubleError: A key is written without quotes, or what it changes does not fly.
    """
    instead = dict(_instead(file))
    for number, (key, value) in enumerate(file.changes.items()):
        names = key.split(".")
        if names[0] == OWN_SECTION:
            raise KeyTroubleError(f"changes.{key}: '{OWN_SECTION}' is what the timeline is written into")
        if len(names) == 1 and isinstance(value, Mapping):
            inside = next((inner for inner, _ in _leaves(key, value)), f"{key}.…")
            raise KeyTroubleError(f'changes.{key}: write the whole key in quotes, "{inside}" = …')
        for own, written in instead.items():
            if _is_of(key, own):
                raise KeyTroubleError(f"changes.{key}: {written} stands in its place: change that")
        for earlier in list(file.changes)[:number]:
            if _is_of(earlier, key):
                raise KeyTroubleError(f"changes.{earlier}: {key} below it stands in its place")
        if names[0] == "mock_ups" and names[2:3] == ["control"] and not _flown_by_type(file, rig, names[1]):
            raise KeyTroubleError(
                f"changes.{key}: changes nothing, each {names[1]!r} has a controller of its own: "
                "vehicles.….control"
            )


def _instead(file: ScenarioFile) -> Iterator[tuple[str, str]]:
    """Keys of the rig that the scenario's own keys are written into, and the scenario's."""
    if file.obstacles:
        yield "table.keep_out", "obstacles"
    for name, keys in file.vehicles.items():
        if keys.start is not None:
            for own in (f"vehicles.{name}.hold", *(f"laboratory.{name}.{key}" for key in STARTS)):
                yield own, f"vehicles.{name}.start"
        if keys.control is not None:
            yield f"vehicles.{name}.control", f"vehicles.{name}.control"
        for key, _ in _leaves("laboratory", keys.laboratory):
            yield f"laboratory.{name}.{key.partition('.')[2]}", f"vehicles.{name}.{key}"


def _is_of(key: str, table: str) -> bool:
    """Whether a key is another one, or inside it."""
    return f"{key}.".startswith(f"{table}.")


def _flown_by_type(file: ScenarioFile, rig: Rig, mock_up: str) -> bool:
    """Whether the controller of a type flies any vehicle; true for a type that is not there."""
    of_type = [name for name, vehicle in rig.vehicles.items() if vehicle.mock_up == mock_up]
    own = {name for name, keys in file.vehicles.items() if keys.control is not None}
    ways = [key.split(".") for key in file.changes]
    own |= {way[1] for way in ways if way[0] == "vehicles" and way[2:3] == ["control"]}
    return not of_type or any(
        name not in own and control_of(rig, name)[1].startswith("mock_ups.") for name in of_type
    )


def _waiting(rig: Rig) -> Changes:
    """Programs begin at t = 0, whoever chose them."""
    return {
        f"vehicles.{name}.control": {**control_of(rig, name)[0].model_dump(), "waits": True}
        for name in rig.vehicles
    }


def _changes(file: ScenarioFile, rig: Rig, *, is_hardware: bool) -> Changes:
    changes: Changes = {}
    if file.obstacles:  # the safety filter keeps out of them, too
        rigs = [section.model_dump() for section in rig.table.keep_out]
        own = [
            {"name": f"obstacle_{number}", **each.model_dump()} for number, each in enumerate(file.obstacles)
        ]
        changes["table.keep_out"] = rigs + own
    for key, value in file.changes.items():
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
            values = [keys.start.x_m, keys.start.y_m], keys.start.heading_deg
            changes |= {f"laboratory.{name}.{key}": value for key, value in zip(STARTS, values, strict=True)}
        changes |= dict(_leaves(f"laboratory.{name}", keys.laboratory))
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


def _listed(rig: Rig) -> str:
    return ", ".join(rig.vehicles)
