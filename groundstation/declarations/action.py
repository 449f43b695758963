"""THE TABLE of actions that can be requested of a vehicle: who answers, and how many numbers it takes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from groundstation.messages.definitions import Ack, Request


@dataclass(frozen=True, slots=True)
class Action:
    """One row.

    Attributes:
        answered_by: Name of the node that carries it out and answers.
        arguments: Names of its numbers, with units.
        summary: For people.
    """

    answered_by: str
    arguments: tuple[str, ...]
    summary: str


ACTIONS: Mapping[str, Action] = MappingProxyType(
    {
        "arm": Action("guard", (), "let valves open"),
        "disarm": Action("guard", (), "close all valves and keep them closed"),
        "stop": Action("guard", (), "close all valves at once and latch it"),
        "release": Action("guard", (), "end a latched stop; the vehicle stays disarmed"),
        "brake": Action(
            "command_mux", (), "take the speed away and hold still, whatever the controller says"
        ),
        "resume": Action("command_mux", (), "end braking or pushing"),
        "push": Action(
            "command_mux",
            ("force_x_n", "force_y_n", "torque_nm", "span_s"),
            "push by hand, body axes, for at most 10 s; the controller waits",
        ),
        "float_on": Action("valve_writer", (), "switch the float air on"),
        "float_off": Action("valve_writer", (), "cut the float air: the vehicle lands"),
        "picture": Action(
            "star_tracker", (), "keep the next picture of the star camera, with its stars named"
        ),
        "go_to": Action("controller", ("x_m", "y_m", "heading_rad"), "hold another pose"),
    }
)


def refusal(request: Request) -> str:
    """Why a request cannot be understood; empty if it can."""
    row = ACTIONS.get(request.action)
    if row is None:
        return f"unknown action '{request.action}' (known: {', '.join(ACTIONS)})"
    if len(request.argument) != len(row.arguments):
        wanted = ", ".join(row.arguments) or "no numbers"
        return f"{request.action} takes {wanted}, found {len(request.argument)} numbers"
    if not all(math.isfinite(number) for number in request.argument):
        return f"{request.action} takes finite numbers, found {request.argument}"
    return ""


def is_for(request: Request, node: str) -> bool:
    """Whether a node has to answer a request; what nobody knows is refused by the guard."""
    row = ACTIONS.get(request.action)
    return (row.answered_by if row is not None else "guard") == node


def answer(request: Request, now_ns: int, reason: str = "") -> Ack:
    """The answer to a request: accepted unless there is a reason against it."""
    return Ack(
        now_ns, request.vehicle, request.request_id, request.author, request.action, not reason, reason
    )
