"""Conditions as they are written: read, checked against the table, written out by names. Pure."""

import math
import re
from collections.abc import Iterable, Mapping

from groundstation.declarations.calls import shortened
from groundstation.parts.scenario.conditions import FLAGS, MEASURES, SETTLED, Bounds, Condition, Term

_TERM = re.compile(r"^\s*(?:(\w+)\.(\w+)|(\w+)\(([\w\s,]*)\)\s*(<=|>=|<|>)\s*([-+.\dEeinfa]+))\s*$")


class ConditionError(ValueError):
    """A condition that cannot be understood or can never hold; the text is one sentence."""


def plain(condition: Condition) -> str:
    """The condition without groups: every vehicle by its name."""
    return " and ".join(map(_spelled, condition.terms))


def _spelled(term: Term) -> str:
    if term.flag:
        return f"{term.vehicles[0]}.{term.flag}"
    return f"{term.measure}({','.join(term.vehicles)}) {'<' if term.is_below else '>'} {term.bound:g}"


def read_condition(text: str, groups: Mapping[str, tuple[str, ...]], bounds: Bounds) -> Condition:
    """Read a condition.

    Args:
        text: As the scenario file spells it.
        groups: Vehicles by the word for them: each vehicle's own name, ``all``, ``followers``.
        bounds: Of the table.

    Raises:
        ConditionError: It is not understood, names what is not there, or can never hold.
    """
    terms: list[Term] = []
    for part in re.split(r"\band\b", text):
        terms += _terms(part, groups, bounds)
    _check_together(terms)
    return Condition(text, tuple(terms))


def _check_together(terms: Iterable[Term]) -> None:
    """Refuse terms that exclude each other: a vehicle has one mode, a number one value."""
    modes: dict[str, str] = {}
    spans: dict[tuple[str, frozenset[str]], tuple[float, float]] = {}
    for term in terms:
        of = term.vehicles[0]
        if term.measure:
            key = term.measure, frozenset(term.vehicles)
            low, high = spans.get(key, (-math.inf, math.inf))
            low, high = (low, min(high, term.bound)) if term.is_below else (max(low, term.bound), high)
            if low >= high:
                raise ConditionError(
                    f"{term.measure}({', '.join(term.vehicles)}) cannot be above {low:g} and below {high:g}"
                )
            spans[key] = low, high
        elif term.flag != SETTLED and modes.setdefault(of, term.flag) != term.flag:
            raise ConditionError(f"{of} cannot be {modes[of]} and {term.flag} at the same time")


def _terms(text: str, groups: Mapping[str, tuple[str, ...]], bounds: Bounds) -> list[Term]:
    found = _TERM.match(text)
    if found is None:
        raise ConditionError(
            f"{shortened(text.strip())!r} is no condition: expected for example 'alpha.settled' or "
            f"'distance_mm(alpha,beta) < 400'; numbers: {', '.join(MEASURES)}; flags: {', '.join(FLAGS)}"
        )
    name, flag, measure, listed, sign, number = found.groups()
    if name is not None:
        if flag not in FLAGS:
            raise ConditionError(f"{flag!r} is no flag of a vehicle: there are {', '.join(FLAGS)}")
        return [Term((vehicle,), flag=flag) for vehicle in _vehicles(name, groups)]
    return [_number(measure, [word.strip() for word in listed.split(",")], sign, number, groups, bounds)]


def _number(
    measure: str,
    names: list[str],
    sign: str,
    number: str,
    groups: Mapping[str, tuple[str, ...]],
    bounds: Bounds,
) -> Term:
    if measure not in MEASURES:
        raise ConditionError(f"{measure!r} is no number to wait for: there are {', '.join(MEASURES)}")
    row = MEASURES[measure]
    vehicles = tuple(vehicle for name in names for vehicle in _vehicles(name, groups))
    if len(vehicles) != row.takes or len(set(vehicles)) != row.takes:
        wanted = "two different vehicles" if row.takes == 2 else "one vehicle"
        raise ConditionError(f"{measure} takes {wanted}, found ({', '.join(names)})")
    try:
        bound = float(number)
    except ValueError:
        bound = math.nan
    if not math.isfinite(bound):
        raise ConditionError(f"{number!r} is no number that {measure} could be compared with")
    is_below = sign.startswith("<")
    low, high = row.low, row.high(bounds)
    if (is_below and bound <= low) or (not is_below and bound >= high):
        raise ConditionError(
            f"{measure}({', '.join(vehicles)}) {sign} {bound:g} can never come true on this table: "
            f"it lies between {low:g} and {high:g}"
        )
    return Term(vehicles, measure=measure, is_below=is_below, bound=bound)


def _vehicles(name: str, groups: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    if name not in groups:
        raise ConditionError(f"{name!r} is no vehicle here: there are {', '.join(groups)}")
    if not groups[name]:
        raise ConditionError(f"{name!r} are none here: no vehicle follows another")
    return groups[name]
