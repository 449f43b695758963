"""A multiplexer of one vehicle and what arrives at it: what its tests share."""

import json
import math
from functools import cache

from groundstation.control.allocation import Allocator
from groundstation.control.brake import BrakeConfig
from groundstation.control.braking import Braking
from groundstation.control.keep_in import rectangle
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.mux import CommandMux, MuxConfig
from groundstation.control.safety_filter import SafetyFilter, SafetyFilterConfig
from groundstation.control.state import BodyWrench
from groundstation.control.surroundings import Surroundings
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.declarations.request import Request
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.command_mux_node import CommandMuxNode
from groundstation.parts.valves.messages import ValveSelection
from groundstation.parts.valves.safe_wish import SafeWish

MS = 1_000_000
MODEL = VehicleModel(11.0, 0.25, square_of_eight())


def modulator():
    return PulseModulator(Allocator(MODEL), PulseConfig())


@cache
def made():
    pulses = modulator()
    braking = Braking(BrakeConfig(), MODEL, pulses.envelope, 100 * MS)
    filtering = SafetyFilter(SafetyFilterConfig(), rectangle((4.0, 3.0), margin_m=0.2))
    safety = SafeWish("alpha", braking, filtering, Surroundings(0.2), MODEL)
    return CommandMuxNode("alpha", ("beta",), CommandMux(MuxConfig()), braking, safety, pulses)


def ruling(law, mode=None, cause="the cause"):
    usual = {"controller": "flying", "brake": "braking", "closed": "landed"}
    opens = law != "closed"
    return Supervision(
        0, "alpha", mode or usual[law], law, opens, opens, False, math.inf, True, 0, cause, "", 0, (), ()
    )


PUSH = BodyWrench((0.1, 0.0), 0.0)


def demand(push=PUSH):
    fx, fy = push.force_body_n
    return Wrench(0, "alpha", fx, fy, 0.0, 0.0, 0.0, push.torque_nm)


def pulses(*pushes):
    """On-times of wrenches that follow each other, from nothing carried over."""
    made = modulator()
    return [bytes(made.update(push).on_time_ms) for push in pushes]


def state(
    now_ns, position=(0.0, 0.0), velocity=(0.0, 0.0), status="flying", rate_rad_s=0.0, heading_rad=0.0,
    vehicle="alpha",
):  # fmt: skip
    return VehicleState(
        now_ns, vehicle, position, heading_rad, velocity, rate_rad_s, (1e-3, 1e-3, 1e-3), status, 1
    )


def request(action, **arguments):
    return Request(0, "alpha", 1, "operator", action, json.dumps(arguments))


def push(**arguments):
    return request(
        "push", **{"force_x_n": 0.2, "force_y_n": 0.0, "torque_nm": 0.0, "span_s": 0.3} | arguments
    )


def tick(mux, now_ms):
    return selected(mux.tick(now_ms * MS))


def selected(messages):
    """The selection among what was published."""
    [selection] = [each for each in messages if isinstance(each, ValveSelection)]
    return selection


def give(mux, now_ms, push=PUSH):
    """A wrench of the controller arrives."""
    return selected(mux.receive(demand(push), now_ms * MS))


def rule(mux, now_ms, law, **words):
    found = mux.receive(ruling(law, **words), now_ms * MS)
    return [each for each in found if isinstance(each, ValveSelection)]
