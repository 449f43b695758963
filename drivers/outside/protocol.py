"""Texts of programs outside the station: what they may hold, and what is wrong with one. Pure.

::

    outside/VEHICLE/wrench   {"author": "anna", "id": 1, "force_x_n": 0.05, "force_y_n": 0, "torque_nm": 0}
    outside/VEHICLE/request  {"author": "anna", "id": 2, "action": "go_to", "arguments": {"x_m": 0.2, ...}}
    outside/VEHICLE/answer   {"author": "anna", "id": 2, "action": "go_to", "accepted": true, "reason": ""}

Forces and torque are in body axes. Keys beyond these are left alone; whatever is wrong with the others is one
sentence, for nothing that comes from outside may raise anything else.
"""

import json
from dataclasses import dataclass
from enum import StrEnum

PREFIX, WRENCH, REQUEST, ANSWER = "outside", "wrench", "request", "answer"
LONGEST_BYTES = 4096
"""Of a text; nothing that is meant here is as long."""
LONGEST_AUTHOR, LONGEST_ACTION = 64, 64
MOST_WRENCH = 1000.0  # N or N m; no valve gives as much
MOST_ID = 2**32 - 1


class Wrong(StrEnum):
    """What can be wrong with a text; so many counters there are."""

    TOO_LONG = "too_long"
    NO_JSON = "no_json_object"
    MISSING = "key_missing"
    TYPE = "wrong_type"
    RANGE = "out_of_range"
    NO_SUCH_VEHICLE = "no_such_vehicle"


class TextError(ValueError):
    """A text that cannot be used.

    Attributes:
        wrong: What is wrong, to be counted.
    """

    def __init__(self, wrong: Wrong, sentence: str) -> None:
        super().__init__(sentence)
        self.wrong = wrong


@dataclass(frozen=True, slots=True)
class WrenchText:
    """A wrench as a program sends it.

    Attributes:
        author: In whose name; who holds the control lease.
        id: The program's own number of it.
        force_body_n: Mean force, x and y.
        torque_nm: About z.
    """

    author: str
    id: int
    force_body_n: tuple[float, float]
    torque_nm: float


@dataclass(frozen=True, slots=True)
class RequestText:
    """A request as a program sends it; ``arguments`` is a JSON object, checked by whoever answers."""

    author: str
    id: int
    action: str
    arguments: str


def read_wrench(text: bytes) -> WrenchText:
    """A wrench.

    Raises:
        TextError: It is none.
    """
    given = _object(text)
    force = _number(given, "force_x_n"), _number(given, "force_y_n")
    return WrenchText(_author(given), _id(given), force, _number(given, "torque_nm"))


def read_request(text: bytes) -> RequestText:
    """A request.

    Raises:
        TextError: It is none.
    """
    given = _object(text)
    arguments = given.get("arguments", {})
    if not isinstance(arguments, dict):
        raise TextError(Wrong.TYPE, f"arguments is {_short(arguments)}, expected a JSON object")
    action = _word(given, "action", LONGEST_ACTION)
    return RequestText(_author(given), _id(given), action, json.dumps(arguments))


def answer_text(author: str, number: int, action: str, *, accepted: bool, reason: str) -> str:
    """An answer, as it leaves."""
    return json.dumps(
        {"author": author, "id": number, "action": action, "accepted": accepted, "reason": reason}
    )


def key_of(vehicle: str, noun: str) -> str:
    """Key of a vehicle's texts."""
    return f"{PREFIX}/{vehicle}/{noun}"


def split_key(key: str) -> tuple[str, str]:
    """Vehicle and noun of a key; empty where it has no such parts."""
    prefix, _, rest = key.partition("/")
    vehicle, _, noun = rest.partition("/")
    return (vehicle, noun) if prefix == PREFIX else ("", "")


def _object(text: bytes) -> dict[str, object]:
    if len(text) > LONGEST_BYTES:
        raise TextError(Wrong.TOO_LONG, f"the text is longer than {LONGEST_BYTES} bytes")
    try:
        given = json.loads(text)
    except (
        ValueError,
        RecursionError,
    ):  # of UTF-8 that is none, and of numbers with thousands of digits, too
        given = None
    if not isinstance(given, dict):
        raise TextError(Wrong.NO_JSON, f"the text is no JSON object: {_short(text)}")
    return given


def _value(given: dict[str, object], key: str) -> object:
    if key not in given:
        raise TextError(Wrong.MISSING, f"the key {key!r} is missing")
    return given[key]


def _number(given: dict[str, object], key: str) -> float:
    value = _value(given, key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TextError(Wrong.TYPE, f"{key} is {_short(value)}, expected a number")
    if not abs(value) <= MOST_WRENCH:  # NaN is not, either
        raise TextError(Wrong.RANGE, f"{key} is {_short(value)}, expected at most {MOST_WRENCH:g} either way")
    return float(value)


def _id(given: dict[str, object]) -> int:
    value = _value(given, "id")
    if isinstance(value, bool) or not isinstance(value, int):
        raise TextError(Wrong.TYPE, f"id is {_short(value)}, expected a whole number")
    if not 0 <= value <= MOST_ID:
        raise TextError(Wrong.RANGE, f"id is {_short(value)}, expected 0 to {MOST_ID}")
    return value


def _author(given: dict[str, object]) -> str:
    return _word(given, "author", LONGEST_AUTHOR)


def _word(given: dict[str, object], key: str, longest: int) -> str:
    value = _value(given, key)
    if not isinstance(value, str):
        raise TextError(Wrong.TYPE, f"{key} is {_short(value)}, expected a text")
    if not 0 < len(value) <= longest or not value.isprintable():  # halves of surrogates are not, either
        raise TextError(Wrong.RANGE, f"{key} is {_short(value)}, expected 1 to {longest} printable letters")
    return value


def _short(given: object) -> str:
    shown = ascii(given if not isinstance(given, str | bytes) else given[:40])
    return shown if len(shown) <= 40 else f"{shown[:37]}..."
