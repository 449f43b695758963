"""A rig with some of its keys changed: for dispersions, sweeps and tests, without another file."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

from groundstation.declarations.errors import RigError
from groundstation.declarations.rig import Rig
from groundstation.rig.read import build_rig, bytes_of, source_of

OPTIONAL_FROM = 2
"""Tables nearer to the top have names that the rig chose."""


def varied(rig: Rig, changes: Mapping[str, object]) -> Rig:
    """The rig with other values; the files that it names are not read again unless a change names another.

    Args:
        rig: As it was read.
        changes: By key, as the file spells it: ``mock_ups.standard.mass_kg``. An entry of a list of tables
            is found by its name: ``laboratory.alpha.mass_kg`` is that of ``[[laboratory.vehicles]]``; one
            without a name by its number from 0, as those of a list: ``laboratory.table.tilt_rad.0``.

    Raises:
        RigError: A key leads nowhere, or the rig refuses its value.
    """
    source = source_of(rig)
    content = deepcopy(source.content)
    for key, value in changes.items():
        _set(content, key, value)
    return build_rig(content, source.path, tables=type(rig).tables, known=bytes_of(rig))


def _set(content: dict[str, Any], key: str, value: object) -> None:
    *way, last = key.split(".")
    found: object = content
    for place, name in enumerate(way):
        inside = _step(found, name)
        is_list = [*way, last][place + 1].isdecimal()
        if inside is None and place >= OPTIONAL_FROM and isinstance(found, dict) and not is_list:
            inside = found[name] = {}  # the file leaves it out; no key of it is refused later
        if inside is None:
            what = "the rig's file writes no such list" if is_list else "the rig has no such table"
            raise RigError(f"{'.'.join(way[: place + 1])}: {what}")
        found = inside
    if isinstance(found, dict):
        found[last] = value
        return
    if not isinstance(found, list):
        raise RigError(f"{'.'.join(way)}: is no table of the rig")
    at = place_in(found, last)
    if at is None:
        raise RigError(f"{'.'.join(way)}: is a list of {len(found)}, numbered from 0")
    found[at] = value


def place_in(entries: Sequence[object], name: str) -> int | None:
    """The place in a list that a key names by its number; None for what it has not, or has by a name."""
    for place, entry in enumerate(entries):
        if name == str(place) and not (isinstance(entry, dict) and "name" in entry):
            return place
    return None


def _step(table: object, name: str) -> object:
    if isinstance(table, list):
        place = place_in(table, name)
        return None if place is None else table[place]
    if not isinstance(table, dict):
        return None
    if name in table:
        return table[name]
    for entries in table.values():
        if isinstance(entries, list):
            for entry in entries:
                if isinstance(entry, dict) and entry.get("name") == name:
                    return entry
    return None


def value_at(rig: Rig, key: str) -> object:
    """The value that a key has in the file of a rig; None where the file leaves it out.

    Raises:
        RigError: A table on the way is not there.
    """
    found: object = source_of(rig).content
    *way, last = key.split(".")
    for place, name in enumerate(way):
        found = _step(found, name)
        if found is None and place < OPTIONAL_FROM:
            raise RigError(f"{'.'.join(way[: place + 1])}: the rig has no such table")
    return found.get(last) if isinstance(found, dict) else _step(found, last)
