"""A scenario as it was read: its file, its rig, and the same with other values."""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import tomli_w

from groundstation.declarations.errors import RigError, UsageError
from groundstation.declarations.rig import Rig
from groundstation.files.reading import path_of
from groundstation.parts.control.sections import control_of
from groundstation.parts.scenario.sections import ScenarioOfRig, ScenarioSection
from groundstation.rig.read import load_rig, read_text, source_of
from groundstation.rig.variation import place_in, varied
from groundstation.scenario.compiling import compiled_rig, groups_of
from groundstation.scenario.key_trouble import KeyTroubleError
from groundstation.scenario.limits import check_limits
from groundstation.scenario.scenario_file import (
    WHAT,
    ScenarioError,
    ScenarioFile,
    content_of,
    is_scenario,
    parse_content,
)

OF_VEHICLE = ("start", "control", "laboratory", "may_land")
"""Keys of a vehicle that are the scenario's; all others are the rig's."""
OF_SCENARIO = ("timeline", "obstacles", "duration_s", "ready_s")


@dataclass(frozen=True, eq=False, repr=False)
class Scenario:
    """An experiment.

    Attributes:
        path: Of its file.
        content: Keys of the file, changed ones included.
        file: The same, checked.
        base: The rig that it names.
        rig: The rig that flies it: starts, controllers and timeline inside.
    """

    path: Path
    content: dict[str, Any]
    file: ScenarioFile
    base: Rig
    rig: Rig

    def __repr__(self) -> str:
        return f"<scenario {self.name!r} of {self.path}>"

    @property
    def name(self) -> str:
        """Of the scenario."""
        return self.file.name

    @property
    def section(self) -> ScenarioSection:
        """The timeline as its player reads it."""
        found = self.rig.section(ScenarioOfRig).scenario
        assert found is not None
        return found

    def vary(self, changes: Mapping[str, object]) -> "Scenario":
        """The scenario with other values.

        Args:
            changes: By key: of the scenario (``vehicles.alpha.start.x_m``, ``timeline.0.at_s``), or of its
                rig (``laboratory.alpha.mass_kg``, ``mock_ups.standard.mass_kg``).

        Raises:
            ScenarioError: A key leads nowhere, or its value is refused.
        """
        content = deepcopy(self.content)
        for key, value in changes.items():
            if not isinstance(key, str):
                raise ScenarioError(f"{self.path}: {key!r}: a key is a text, 'laboratory.alpha.mass_kg'")
            if is_of_scenario(key):
                _set(content, key, value, self)
            else:
                content.setdefault("changes", {})[key] = value
        return made(content, self.path, self.base)

    def remarked(self, text: str) -> "Scenario":
        """The scenario with a marker at t = 0."""
        section = self.section.model_dump(exclude_none=True)
        section["timeline"] = [{"where": "remark", "at_s": 0.0, "mark": text}, *section["timeline"]]
        return replace(self, rig=varied(self.rig, {"scenario": section}))

    def started_by_hand(self) -> "Scenario":
        """The scenario whose t = 0 also waits for a person's ``start_scenario``."""
        return replace(self, rig=varied(self.rig, {"scenario.by_hand": True}))

    def on_hardware(self, rig: Rig) -> "Scenario":
        """The same scenario on another rig: starts are gone to before t = 0.

        Raises:
            ScenarioError: It injects failures, or does not fit the rig.
        """
        for number, row in enumerate(self.file.timeline):
            if row.failure is not None:
                raise ScenarioError(
                    f"{self.path}: timeline.{number}.failure: hardware cannot be given {row.failure!r}"
                )
        return replace(self, base=rig, rig=_compiled(self.file, self.path, rig, is_hardware=True))


def load(path: Path | str) -> Scenario:
    """Read a scenario file and its rig, and check everything that can be known before anything moves.

    Raises:
        UsageError: One sentence with file and key.
    """
    path = Path(path)
    content = content_of(read_text(path, WHAT), path)
    if not is_scenario(content) and "mock_ups" in content:
        raise ScenarioError(f"{path}: is a rig; a scenario file names the rig that it flies: rig = ...")
    return made(content, path)


def made(content: dict[str, Any], path: Path, base: Rig | None = None) -> Scenario:
    """Make a scenario of the keys of its file.

    Args:
        content: The keys.
        path: Of the file: the path of the rig starts there.
        base: The rig, where it was read before.

    Raises:
        UsageError: One sentence with file and key.
    """
    file = parse_content(content, path)
    if base is None:
        try:
            base = load_rig(path.parent / path_of(file.rig))
        except UsageError as error:
            raise ScenarioError(f"{path}: rig: {error}") from error
    return Scenario(path, content, file, base, _compiled(file, path, base))


def rig_text(rig: Rig) -> str:
    """The text of a rig whose keys have been changed: what is recorded, and what processes read."""
    return tomli_w.dumps(source_of(rig).content)


def is_of_scenario(key: str) -> bool:
    """Whether a key is one of the scenario file itself; all others are keys of its rig."""
    names = key.split(".")
    if names[0] == "vehicles":
        return len(names) > 2 and names[2] in OF_VEHICLE
    return names[0] in OF_SCENARIO


def _compiled(file: ScenarioFile, path: Path, base: Rig, *, is_hardware: bool = False) -> Rig:
    try:
        rig = compiled_rig(file, base, is_hardware=is_hardware)
        check_limits(file, rig, groups_of(rig))
        return rig
    except KeyTroubleError as error:
        raise ScenarioError(f"{path}: {error}") from error
    except RigError as error:
        prefix = f"{source_of(base).path}: "
        raise ScenarioError(f"{path}: {str(error).removeprefix(prefix)}") from error


def _set(content: dict[str, Any], key: str, value: object, scenario: Scenario) -> None:
    *way, last = key.split(".")
    found: Any = content
    if way[:1] == ["vehicles"] and way[1] in scenario.rig.vehicles:  # what the file leaves to its rig
        keys = content.setdefault("vehicles", {}).setdefault(way[1], {})
        if way[2:] == ["start"]:
            keys.setdefault("start", scenario.rig.vehicles[way[1]].hold.model_dump())
        elif way[2:3] == ["control"]:
            section = control_of(scenario.rig, way[1])[0]
            keys.setdefault("control", section.model_dump(include={"controller", "parameters"}))
    for place, name in enumerate(way):
        if isinstance(found, list):
            at = place_in(found, name)
            found = None if at is None else found[at]
        elif isinstance(found, dict):
            found = found.setdefault(name, {}) if way[:1] == ["vehicles"] else found.get(name)
        if not isinstance(found, dict | list):
            raise UsageError(f"{scenario.path}: {'.'.join(way[: place + 1])}: the scenario has no such table")
    if not isinstance(found, dict):
        raise UsageError(f"{scenario.path}: {key}: the scenario has no such key")
    found[last] = value
