"""What a request of a vehicle and its answer are, and the actions that can be requested.

An action is a row of its part: who answers, which arguments it takes. Arguments travel by name as a JSON
object, SI and radians; they are checked once, by the row.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import PACKAGE, U32, Bool, Message, Text
from groundstation.declarations.topic import Rank, Scope, Topic


@dataclass(frozen=True, slots=True, eq=False)
class Request(Message):
    """Something asked of a vehicle; answered on ``ack``.

    Attributes:
        request_id: Unique per author.
        author: Who asks.
        action: Name of an action: arm, disarm, stop, release, float_on, float_off, go_to, ...
        arguments: JSON object of the action's arguments: ``{"x_m": 0.2, "y_m": 0.1, "heading_rad": 1.57}``.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Request"
    TOPIC: ClassVar = Topic("request", rank=Rank.REQUEST, scope=Scope.PROCESS)
    request_id: U32
    author: Text
    action: Text
    arguments: Text


@dataclass(frozen=True, slots=True, eq=False)
class Ack(Message):
    """The answer to a request."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Ack"
    TOPIC: ClassVar = Topic("ack", rank=Rank.REQUEST, scope=Scope.PROCESS)
    request_id: U32
    author: Text
    action: Text
    accepted: Bool
    reason: Text


LONGEST_NAME, LONGEST_TEXT = 64, 500
"""Letters; names and reasons are shown on one line of a screen, kept on disk and repeated on the bus."""


class ArgumentError(ValueError):
    """What was asked for cannot be understood; the text is one sentence."""


Value = float | int | str | bool


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of an action.

    Attributes:
        name: With its unit.
        summary: For people.
        kind: Its type; a whole number is taken for a float, too.
        low: Least value of a number.
        high: Largest value of a number.
        longest: Letters of a text.
        default: What it is if it is left out; None where it must be given.
    """

    name: str
    summary: str = ""
    kind: type[Value] = float
    low: float = -math.inf
    high: float = math.inf
    longest: int = LONGEST_TEXT
    default: Value | None = None

    def read(self, given: object, action: str) -> Value:
        """The value given, checked.

        Raises:
            ArgumentError: It is of another type, not finite, out of range, too long or more than one line.
        """
        wrong_bool = isinstance(given, bool) and self.kind is not bool
        if self.kind is float and isinstance(given, int) and not wrong_bool:
            try:
                given = float(given)
            except OverflowError:
                given = math.inf
        if wrong_bool or not isinstance(given, self.kind):
            wanted = "a number" if self.kind is float else f"a value of type {self.kind.__name__}"
            raise ArgumentError(f"{action}: {self.name} is {_short(given)}, expected {wanted}")
        if isinstance(given, str):
            return _line(given, f"{action}: {self.name}", self.longest)
        if isinstance(given, float) and not math.isfinite(given):
            raise ArgumentError(f"{action}: {self.name} is {given}, expected a finite number")
        if isinstance(given, float | int) and not self.low <= given <= self.high:
            shown = f"{given:g}" if isinstance(given, float) else _short(given)
            raise ArgumentError(f"{action}: {self.name} is {shown}, expected {self.low:g} to {self.high:g}")
        return given


@dataclass(frozen=True, slots=True)
class Action:
    """What can be requested of a vehicle, or of the rig.

    Attributes:
        name: Of the action.
        answered_by: Name of the node that carries it out and answers.
        summary: For people.
        arguments: In the order in which a command line takes them.
        is_of_rig: It concerns the rig: asked for once, whatever vehicle is named.
    """

    name: str
    answered_by: str
    summary: str
    arguments: tuple[Argument, ...] = ()
    is_of_rig: bool = False

    def check(self, given: Mapping[str, object]) -> dict[str, Value]:
        """The arguments, complete and checked.

        Raises:
            ArgumentError: One is missing, unknown, of another type or out of range.
        """
        known = {argument.name: argument for argument in self.arguments}
        for name in given:
            if name not in known:
                wanted = ", ".join(known) or "no arguments"
                raise ArgumentError(f"{self.name} has no argument {_short(name)}: it takes {wanted}")
        values: dict[str, Value] = {}
        for name, argument in known.items():
            if name in given:
                values[name] = argument.read(given[name], self.name)
            elif argument.default is not None:
                values[name] = argument.default
            else:
                raise ArgumentError(f"{self.name} needs {name}: it takes {', '.join(known)}")
        return values

    def read(self, request: Request) -> dict[str, Value]:
        """The arguments of a request.

        Raises:
            ArgumentError: They are no JSON object, or not those of the action; or who asks has no name that
                can be shown.
        """
        checked_name(request.author)
        try:
            given = json.loads(request.arguments or "{}")
        except (ValueError, RecursionError):
            raise ArgumentError(f"{self.name}: the arguments are no JSON object") from None
        if not isinstance(given, dict):
            raise ArgumentError(f"{self.name}: the arguments are no JSON object")
        return self.check(given)


def checked_name(author: str) -> str:
    """The name of who asks.

    Raises:
        ArgumentError: It is too long to be shown, or more than one line.
    """
    return _line(author, "the name of who asks", LONGEST_NAME)


def shown_name(author: str) -> str:
    """The name of who asks for what is never refused: on one line, not too long, never empty."""
    words = "".join(letter if letter.isprintable() else " " for letter in author).split()
    return " ".join(words)[:LONGEST_NAME] or "somebody"


def table_of(*actions: Action) -> dict[str, Action]:
    """Actions by their names."""
    return {action.name: action for action in actions}


def answer(request: Request, now_ns: int, reason: str = "") -> Ack:
    """The answer to a request: accepted unless there is a reason against it."""
    return Ack(
        now_ns, request.vehicle, request.request_id, request.author, request.action, not reason, reason
    )


def _line(text: str, what: str, most: int) -> str:
    if len(text) > most:
        raise ArgumentError(f"{what} is {len(text)} letters long, expected at most {most}")
    if not text.isprintable():
        raise ArgumentError(f"{what} is {_short(text)}, expected one line of letters that can be printed")
    return text


def _short(given: object) -> str:
    text = repr(given)
    return text if len(text) <= 40 else f"{text[:37]}..."
