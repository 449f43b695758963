"""Values that vary from run to run, drawn so that run k of a seed is the same wherever it is flown.

Each key has a stream of random numbers of its own, from (seed, run, key): the order of keys, the number of
workers and keys that are added later change nothing of the others.
"""

from collections.abc import Iterator

import numpy as np

from groundstation.declarations.errors import RigError
from groundstation.declarations.rig import Rig
from groundstation.rig.variation import place_in, value_at
from groundstation.scenario.loading import Scenario, is_of_scenario
from groundstation.scenario.scenario_file import Dispersion, ScenarioError

Drawn = float | int | str | bool
LAST_SEED = 2**31
ANY = "*"
SEED = "laboratory.seed"
"""Of each run: no key to draw or sweep."""


def draw(scenario: Scenario, seed: int, run: int) -> dict[str, Drawn]:
    """Values of a run, by expanded key.

    Args:
        scenario: Whose dispersions.
        seed: Of the campaign.
        run: Number, from 0.

    Raises:
        ScenarioError: A value is to be added to a key that has none.
    """
    return {key: _drawn(scenario, key, row, seed, run) for key, row in expanded_keys(scenario)}


def laboratory_seed(seed: int, run: int) -> int:
    """Seed of the laboratory in a run of a campaign."""
    return int(np.random.default_rng([seed, run]).integers(LAST_SEED))


def expanded_keys(scenario: Scenario) -> list[tuple[str, Dispersion]]:
    """Keys without ``*``, each with its law, in the order of the file.

    Raises:
        ScenarioError: ``*`` stands where nothing can be listed; or one value has two laws.
    """
    found: dict[str, tuple[str, Dispersion]] = {}
    common: dict[str, Dispersion] = {}
    for pattern, row in scenario.file.dispersions.items():
        where = f"{scenario.path}: dispersions.{pattern}"
        other = common.setdefault(row.common or pattern, row)
        if _kind(other) != _kind(row):
            raise ScenarioError(
                f"{where}: common = {row.common!r} draws one value, which cannot be both {other.law!r} and "
                f"{row.law!r}"
            )
        for key in _expanded(scenario, pattern):
            if key == SEED:
                raise ScenarioError(
                    f"{where}: each run has a seed of its own, drawn from that of the campaign"
                )
            if key in found:
                raise ScenarioError(f"{where}: {key} is drawn by {found[key][0]!r} already")
            found[key] = pattern, row
    return [(key, row) for key, (_, row) in found.items()]


def _kind(row: Dispersion) -> tuple[str, int]:
    """Laws of one kind make like values of one draw."""
    return row.law.removeprefix("add_"), len(row.choice or ())


def extremes(scenario: Scenario) -> Iterator[tuple[str, dict[str, Drawn]]]:
    """What a campaign may draw at worst: every choice, and both ends of what is uniform.

    Yields:
        Key as the file has it, and values by expanded key.
    """
    for pattern, row in scenario.file.dispersions.items():
        keys = tuple(_expanded(scenario, pattern))
        for value in row.choice or row.uniform or ():
            yield pattern, dict.fromkeys(keys, value)
        for value in row.add_uniform or ():
            yield pattern, {key: _nominal(scenario, key) + value for key in keys}


def _expanded(scenario: Scenario, pattern: str) -> Iterator[str]:
    names = pattern.split(".")
    if ANY not in names:
        yield pattern
        return
    rig: Rig = scenario.base
    vehicles, types = tuple(rig.vehicles), tuple(rig.mock_ups)
    lists = {"vehicles": vehicles, "laboratory": vehicles, "mock_ups": types}
    if names.count(ANY) > 1 or names[1:2] != [ANY] or names[0] not in lists:
        raise ScenarioError(
            f"{scenario.path}: dispersions.{pattern}: '*' stands for names behind {', '.join(lists)}, "
            "for example 'vehicles.*.start.x_m'"
        )
    for name in lists[names[0]]:
        yield ".".join((names[0], name, *names[2:]))


def _drawn(scenario: Scenario, key: str, row: Dispersion, seed: int, run: int) -> Drawn:
    rng = np.random.default_rng([seed, run, *(row.common or key).encode()])
    law = row.law
    if law == "choice":
        assert row.choice is not None
        return row.choice[int(rng.integers(len(row.choice)))]
    first, second = getattr(row, law)
    value = float(rng.normal(first, second) if law.endswith("normal") else rng.uniform(first, second))
    return _nominal(scenario, key) + value if law.startswith("add_") else value


def _nominal(scenario: Scenario, key: str) -> float:
    found = _value(scenario, key)
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise ScenarioError(
            f"{scenario.path}: dispersions.{key}: there is no number in the file to add to; "
            "give 'normal' or 'uniform'"
        )
    return float(found)


def _value(scenario: Scenario, key: str) -> object:
    names = key.split(".")
    if is_of_scenario(key):
        if names[0] == "vehicles" and names[2:3] == ["start"] and len(names) == 4:
            return getattr(scenario.rig.vehicles[names[1]].hold, names[3], None)
        found: object = scenario.content
        for name in names:
            if isinstance(found, list):
                place = place_in(found, name)
                found = None if place is None else found[place]
            else:
                found = found.get(name) if isinstance(found, dict) else None
        return found
    try:
        return value_at(scenario.rig, key)
    except RigError as error:
        raise ScenarioError(f"{scenario.path}: dispersions.{error}") from error
