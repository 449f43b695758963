"""Fly a mock-up along a small circle from outside: a program that needs nothing but a client of Zenoh.

    pip install eclipse-zenoh
    python circle.py tcp/127.0.0.1:7447 alpha --as anna

It asks for the control lease, reads the state, sends ten wrenches a second in body axes, and gives
the lease back at the end. If it is killed or hangs, the station brakes the vehicle and holds it.
"""

import argparse
import getpass
import json
import math
import queue
import struct
import sys
import time
from typing import NamedTuple

import zenoh

PERIOD_S = 0.1
LEASE_S, RENEWED_S = 30.0, 10.0
"""A short lease that is renewed: it ends by itself where this program does."""
ANSWER_S = 3.0
STIFFNESS_1_S2, DAMPING_1_S = 0.16, 0.8


class State(NamedTuple):
    """A state of the vehicle: metres, radians, seconds, table axes."""

    x: float
    y: float
    heading: float
    vx: float
    vy: float
    rate: float


def state_of(payload: bytes) -> State:
    """A state out of ``VEHICLE/state``: CDR, little endian, six doubles behind a ROS 2 header."""
    (length,) = struct.unpack_from("<I", payload, 12)  # of the vehicle's name, its last zero included
    begin = 16 + length
    begin += (4 - begin) % 8  # doubles begin at multiples of 8 behind the first four bytes
    return State(*struct.unpack_from("<6d", payload, begin))


class Vehicle:
    """A vehicle as a program outside sees it.

    Args:
        session: With the hub of the station.
        name: Of the vehicle.
        author: In whose name it is commanded.
    """

    def __init__(self, session: zenoh.Session, name: str, author: str) -> None:
        self.name, self.author = name, author
        self._session = session
        self._number = 0
        self._answers: queue.SimpleQueue[dict[str, object]] = queue.SimpleQueue()
        self._states: queue.SimpleQueue[State] = queue.SimpleQueue()
        self._newest: State | None = None
        session.declare_subscriber(
            f"outside/{name}/answer", lambda sample: self._answers.put(json.loads(sample.payload.to_bytes()))
        )
        session.declare_subscriber(
            f"{name}/state", lambda sample: self._states.put(state_of(sample.payload.to_bytes()))
        )

    def ask(self, action: str, **arguments: float) -> str:
        """Ask for something and wait for the answer: why it was refused, empty where it was accepted."""
        number = self._put("request", action=action, arguments=arguments)
        until_s = time.monotonic() + ANSWER_S
        while (left_s := until_s - time.monotonic()) > 0.0:
            try:
                answer = self._answers.get(timeout=left_s)
            except queue.Empty:
                break
            if (answer["author"], answer["id"]) == (self.author, number):
                return "" if answer["accepted"] else str(answer["reason"])
        return "nobody answers"

    def push(self, force_x_n: float, force_y_n: float, torque_nm: float) -> None:
        """Send a wrench in body axes; it holds for 0.24 s or until the next one."""
        self._put("wrench", force_x_n=force_x_n, force_y_n=force_y_n, torque_nm=torque_nm)

    def refusal(self) -> str:
        """Why the newest wrenches did not count; empty if they did."""
        found = ""
        while not self._answers.empty():
            answer = self._answers.get()
            if (answer["author"], answer["action"]) == (self.author, "wrench"):
                found = "" if answer["accepted"] else str(answer["reason"])
        return found

    def state(self) -> State:
        """The newest state; waits for the first one."""
        while self._newest is None or not self._states.empty():
            try:
                self._newest = self._states.get(timeout=ANSWER_S)
            except queue.Empty:
                raise SystemExit(
                    f"there is no state of {self.name}: is that its name, and does it run?"
                ) from None
        return self._newest

    def _put(self, noun: str, **content: object) -> int:
        self._number += 1
        text = json.dumps({"author": self.author, "id": self._number, **content})
        self._session.put(f"outside/{self.name}/{noun}", text)
        return self._number


def wrench(
    state: State, begin: State, given: argparse.Namespace, time_s: float
) -> tuple[float, float, float]:
    """Force (body axes) and torque that keep it on the circle, which leads through where it began."""
    turn = 2.0 * math.pi / given.period
    eased_s = time_s - given.period / 8.0 * math.tanh(8.0 * time_s / given.period)  # it begins slowly
    angle, speed = turn * eased_s, turn * given.radius * math.tanh(8.0 * time_s / given.period) ** 2
    x, y = begin.x + given.radius * math.sin(angle), begin.y + given.radius * (1.0 - math.cos(angle))
    vx, vy = speed * math.cos(angle), speed * math.sin(angle)
    pull = speed * speed / given.radius
    ax = -pull * math.sin(angle) + STIFFNESS_1_S2 * (x - state.x) + DAMPING_1_S * (vx - state.vx)
    ay = pull * math.cos(angle) + STIFFNESS_1_S2 * (y - state.y) + DAMPING_1_S * (vy - state.vy)
    lean = math.remainder(begin.heading - state.heading, 2.0 * math.pi)
    torque = given.inertia * (STIFFNESS_1_S2 * lean - DAMPING_1_S * state.rate)
    cosine, sine = math.cos(state.heading), math.sin(state.heading)
    return given.mass * (cosine * ax + sine * ay), given.mass * (cosine * ay - sine * ax), torque


def fly(vehicle: Vehicle, given: argparse.Namespace) -> None:
    """Circle until the time is over; a refusal ends it."""
    begin, begin_s = vehicle.state(), time.monotonic()
    due_s, renew_s = begin_s, begin_s + RENEWED_S
    while due_s < begin_s + given.duration:
        vehicle.push(*wrench(vehicle.state(), begin, given, due_s - begin_s))
        due_s += PERIOD_S
        time.sleep(max(due_s - time.monotonic(), 0.0))  # one wrench a period, whatever the last one took
        refusal = vehicle.refusal()
        if due_s >= renew_s and not refusal:
            renew_s += RENEWED_S
            refusal = vehicle.ask("take_control", for_s=LEASE_S)
        if refusal:
            raise SystemExit(f"{vehicle.name}: {refusal}")


def main() -> None:
    """Take control, circle, give control back."""
    parser = argparse.ArgumentParser(description="Fly a mock-up along a small circle from outside.")
    parser.add_argument("endpoint", help="of the station's hub, e.g. tcp/127.0.0.1:7447")
    parser.add_argument("vehicle", help="its name")
    parser.add_argument("--as", dest="author", default=getpass.getuser(), help="in whose name")
    parser.add_argument("--radius", type=float, default=0.15, help="m")
    parser.add_argument("--period", type=float, default=40.0, help="s, of one turn")
    parser.add_argument("--duration", type=float, default=45.0, help="s")
    parser.add_argument("--mass", type=float, default=11.0, help="kg")
    parser.add_argument("--inertia", type=float, default=0.25, help="kg m^2")
    given = parser.parse_args()
    config = {"mode": "client", "connect": {"endpoints": [given.endpoint]}}
    try:
        session = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    except zenoh.ZError:
        raise SystemExit(f"no station answers at {given.endpoint}") from None
    with session:
        vehicle = Vehicle(session, given.vehicle, given.author)
        refusal = vehicle.ask("take_control", for_s=LEASE_S)
        if refusal:
            raise SystemExit(f"{given.vehicle}: {refusal}")
        print(f"{given.author} flies {given.vehicle}", flush=True)
        try:
            fly(vehicle, given)
        except KeyboardInterrupt:
            print("ending")
        finally:
            vehicle.ask("give_control")
    print(f"{given.vehicle} is the controller's again")


if __name__ == "__main__":
    sys.exit(main())
