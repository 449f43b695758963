"""From a scenario file to the rig that flies it: starts, controllers, the timeline as its player reads it.

Everything that can be known before anything moves is checked here; each mistake is one sentence with file,
key and what was expected.
"""

import itertools
from collections.abc import Iterator, Mapping
from typing import Any

from groundstation.control.controllers import controllers
from groundstation.declarations.rig import Rig
from groundstation.parts.control.sections import control_of, neighbours_of
from groundstation.parts.supervision.sections import SupervisionOfVehicle
from groundstation.rig.variation import varied
from groundstation.scenario.key_trouble import KeyTroubleError
from groundstation.scenario.places import check_places, check_starts
from groundstation.scenario.scenario_file import ALL, FOLLOWERS, Limit, ScenarioFile
from groundstation.scenario.timeline import Changes, Groups, members, timeline_rows

OWN_SECTION = "scenario"


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
        names = [name for word in limit.vehicles for name in members(f"{key}.vehicles", word, groups)]
        return list(itertools.combinations(dict.fromkeys(names), 2)) if len(names) > 1 else [(names[0],)]
    assert limit.vehicle is not None
    return [(name,) for name in members(f"{key}.vehicle", limit.vehicle, groups)]


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


def _listed(rig: Rig) -> str:
    return ", ".join(rig.vehicles)
