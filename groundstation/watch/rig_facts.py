"""What a report needs of the rig of a recording, from the text that the recording carries.

None of the rig's files is read: a report is made wherever the recording is.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field

from pydantic import TypeAdapter, ValidationError

from groundstation.declarations.rig import KeepOutSection, TableSection
from groundstation.declarations.vehicle_type import ValvesSection


@dataclass(frozen=True, slots=True)
class RigFacts:
    """Some facts; what the text does not give is left out.

    Attributes:
        name: Of the rig.
        table_m: Least and largest x, least and largest y; None where it is not known.
        valves: Of each vehicle.
        keep_out: x, y and radius (m, table frame) of each place that mock-ups keep out of.
    """

    name: str = ""
    table_m: tuple[float, float, float, float] | None = None
    valves: Mapping[str, ValvesSection] = field(default_factory=dict)
    keep_out: tuple[tuple[float, float, float], ...] = ()

    def half_width_m(self, vehicle: str) -> float:
        """From the centre of a mock-up to its faces, where the valves are."""
        return self.valves.get(vehicle, ValvesSection()).arm_m


def rig_facts(text: str) -> RigFacts:
    """Read a rig file's text; a text that is no rig gives no facts."""
    try:
        rig = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return RigFacts()
    valves = {}
    for name, vehicle in _table(rig, "vehicles").items():
        kind = (
            _table(_table(rig, "mock_ups"), vehicle.get("mock_up", "")) if isinstance(vehicle, dict) else {}
        )
        try:
            valves[name] = ValvesSection.model_validate(_table(kind, "valves"))
        except ValidationError:
            continue
    edges = _table(rig, "table")
    try:
        table = TableSection.model_validate({key: edges[key] for key in _EDGES if key in edges})
        table_m = table.x_min_m, table.x_max_m, table.y_min_m, table.y_max_m
    except ValidationError:
        table_m = None
    return RigFacts(str(rig.get("name", "")), table_m, valves, _keep_out(edges))


_EDGES = ("x_min_m", "x_max_m", "y_min_m", "y_max_m")


def _keep_out(table: Mapping[str, object]) -> tuple[tuple[float, float, float], ...]:
    try:
        found = TypeAdapter(tuple[KeepOutSection, ...]).validate_python(table.get("keep_out", ()))
    except ValidationError:
        return ()
    return tuple((place.x_m, place.y_m, place.radius_m) for place in found)


def _table(parent: Mapping[str, object], key: object) -> dict[str, object]:
    found = parent.get(str(key))
    return found if isinstance(found, dict) else {}
