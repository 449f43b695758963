r"""The laboratory's own channel: failures as they begin and end, and orders to inject one. Pure.

Live, one JSON object a line (UTF-8, ended by `\n`), over TCP. A new client first gets the failures that are
there already. From the laboratory:

    {"failure": "stuck_open_valve", "vehicle": "alpha", "parameters": {"valve": 3.0}, "is_active": true}
    {"refused": "no failure of kind 'gremlin'; the kinds are ..."}

To the laboratory (`for_s` null: until the laboratory is switched off; `parameters` may be left out):

    {"inject": "stuck_open_valve", "vehicle": "alpha", "parameters": {"valve": 3}, "for_s": 10.0}

JSON knows no NaN: a parameter that is one (`code` of `stuck_gyro`: the last code) is null on the wire.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

LABORATORY_CHANNEL = "laboratory"
MAX_LINE_BYTES = 4096


@dataclass(frozen=True, slots=True)
class FailureEvent:
    """An injected failure has begun or ended; the arrival's stamp states when.

    Attributes:
        kind: A row of the laboratory's table of failures.
        vehicle: Whom it befalls.
        parameters: All of them, with defaults filled in.
        is_active: True when it begins, False when it ends.
    """

    kind: str
    vehicle: str
    parameters: Mapping[str, float]
    is_active: bool


@dataclass(frozen=True, slots=True)
class FailureRefused:
    """An order was not obeyed; `reason` is a sentence."""

    reason: str


@dataclass(frozen=True, slots=True)
class InjectOrder:
    """Start a failure now.

    Attributes:
        kind: A row of the laboratory's table of failures.
        vehicle: Whom it befalls.
        parameters: Those that differ from their defaults.
        for_s: How long; infinite until the laboratory is switched off.
    """

    kind: str
    vehicle: str
    parameters: Mapping[str, float] = field(default_factory=dict)
    for_s: float = math.inf


def encode_event(event: FailureEvent | FailureRefused) -> bytes:
    """The line of an event."""
    if isinstance(event, FailureRefused):
        return _line({"refused": event.reason})
    return _line(
        {
            "failure": event.kind,
            "vehicle": event.vehicle,
            "parameters": {name: _finite(value) for name, value in event.parameters.items()},
            "is_active": event.is_active,
        }
    )


def encode_order(order: InjectOrder) -> bytes:
    """The line of an order."""
    return _line(
        {
            "inject": order.kind,
            "vehicle": order.vehicle,
            "parameters": {name: _finite(value) for name, value in order.parameters.items()},
            "for_s": _finite(order.for_s),
        }
    )


def parse_event(line: str | bytes) -> FailureEvent | FailureRefused:
    """The event in a line of the laboratory.

    Raises:
        ValueError: The line is no event; the message gives the reason in one sentence.
    """
    reported = _parse(line)
    if "refused" in reported:
        _check_keys(reported, {"refused"}, set())
        return FailureRefused(_text(reported, "refused"))
    _check_keys(reported, {"failure", "vehicle", "parameters", "is_active"}, set())
    if not isinstance(reported["is_active"], bool):
        raise ValueError(f"is_active must be true or false, got {reported['is_active']!r}")
    return FailureEvent(
        _text(reported, "failure"),
        _text(reported, "vehicle"),
        _parameters(reported),
        is_active=reported["is_active"],
    )


def parse_order(line: str | bytes) -> InjectOrder:
    """The order that a line gives; whether it can be obeyed is the laboratory's business.

    Raises:
        ValueError: The line is no order; the message gives the reason in one sentence.
    """
    reported = _parse(line)
    _check_keys(reported, {"inject", "vehicle"}, {"parameters", "for_s"})
    for_s = reported.get("for_s")
    return InjectOrder(
        _text(reported, "inject"),
        _text(reported, "vehicle"),
        _parameters(reported),
        math.inf if for_s is None else _number("for_s", for_s),
    )


def _line(reported: dict[str, object]) -> bytes:
    return (json.dumps(reported, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _parse(line: str | bytes) -> dict[str, Any]:
    try:
        reported = json.loads(line, parse_constant=_refuse_constant)
    except RecursionError as error:
        raise ValueError("the line is nested too deeply") from error
    except ValueError as error:  # UnicodeDecodeError and JSONDecodeError among them
        raise ValueError(f"the line is no JSON: {error}") from error
    if not isinstance(reported, dict):
        raise ValueError(f"the line is no JSON object but a {type(reported).__name__}")
    return reported


def _refuse_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is not a number that JSON knows")


def _check_keys(reported: Mapping[str, object], needed: set[str], possible: set[str]) -> None:
    for key in sorted(needed - reported.keys()):
        raise ValueError(f"the line lacks the key {key!r}")
    for key in sorted(reported.keys() - needed - possible):
        raise ValueError(f"the line has the unknown key {key!r}")


def _text(reported: Mapping[str, object], key: str) -> str:
    value = reported[key]
    if not isinstance(value, str):
        raise ValueError(f"{key} must be a text, got {value!r}")
    return value


def _parameters(reported: Mapping[str, object]) -> dict[str, float]:
    given = reported.get("parameters", {})
    if not isinstance(given, dict):
        raise ValueError(f"parameters must be an object of numbers, got {given!r}")
    return {
        name: math.nan if value is None else _number(f"parameter {name}", value)
        for name, value in given.items()
    }


def _number(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{name} must be a number, got {value!r}")
    try:
        number = float(value)
    except OverflowError as error:
        raise ValueError(f"{name} is too large") from error
    if not math.isfinite(number):  # 1e999
        raise ValueError(f"{name} is too large")
    return number
