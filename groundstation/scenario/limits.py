"""Limits against the rig: for whom each holds, and whether there is anything to hold it against."""

import itertools
from collections.abc import Iterator

from groundstation.control.follow import FollowConfig
from groundstation.declarations.rig import Rig
from groundstation.parts.control.sections import control_of, dockings_of
from groundstation.parts.scenario.part import bounds_of
from groundstation.scenario.key_trouble import KeyTroubleError
from groundstation.scenario.quantities import QUANTITIES
from groundstation.scenario.run_tracks import Docks, Keeps, RunTracks
from groundstation.scenario.scenario_file import Limit, ScenarioFile
from groundstation.scenario.timeline import Groups, members


def expanded(limit: Limit, number: int, groups: Groups) -> list[tuple[str, ...]]:
    """Each vehicle that a limit holds for, or each pair of them where its quantity is one of two.

    Raises:
        KeyTroubleError: It names a vehicle that is not there, or one where two are needed.
    """
    key = f"limits.{number}"
    if limit.vehicles is not None:
        named = [name for word in limit.vehicles for name in members(f"{key}.vehicles", word, groups)]
    else:
        assert limit.vehicle is not None
        named = list(members(f"{key}.vehicle", limit.vehicle, groups))
    names = list(dict.fromkeys(named))
    if not QUANTITIES[limit.what].is_of_pair:
        return [(name,) for name in names]
    if len(names) < 2:
        raise KeyTroubleError(f"{key}: {limit.what} is between two vehicles, found {', '.join(names)} alone")
    return list(itertools.combinations(names, 2))


def check_limits(file: ScenarioFile, rig: Rig, groups: Groups) -> None:
    """Each limit holds for vehicles that are there and have its quantity.

    Raises:
        KeyTroubleError: One does not.
    """
    nothing = nothing_flown(file, rig)
    for number, limit in enumerate(file.limits):
        row = QUANTITIES[limit.what]
        for vehicles in expanded(limit, number, groups):
            if not row.is_of_pair and not row.applies(nothing, vehicles[0]):
                raise KeyTroubleError(
                    f"limits.{number}: {vehicles[0]} has no {limit.what} here: it is {row.summary}"
                )


def nothing_flown(file: ScenarioFile, rig: Rig) -> RunTracks:
    """What is known of a run before it flies.

    Args:
        file: The scenario.
        rig: The rig that flies it.
    """
    return RunTracks(
        {},
        (),
        bounds_of(rig),
        tuple((each.x_m, each.y_m, each.radius_m) for each in rig.table.keep_out),
        {name: rig.type_of(name).valves.thrust_n for name in rig.vehicles},
        dict(_keeps(rig)),
        file.duration_s,
        {
            ship: Docks(target, corridor.axis_rad, corridor.contact_m)
            for ship, target, corridor in dockings_of(rig)
        },
    )


def _keeps(rig: Rig) -> Iterator[tuple[str, Keeps]]:
    for name in rig.vehicles:
        section = control_of(rig, name)[0]
        if section.controller == "follow":
            config = FollowConfig.model_validate(section.parameters)
            yield name, Keeps(config.leader, config.distance_m, config.face)
