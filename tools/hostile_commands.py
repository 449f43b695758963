"""Random, hostile sequences of commands to two mock-ups, in virtual time: nobody leaves the table or touches.

Each sequence lasts 60 s after both fly: requests of every kind with drawn arguments, to either mock-up, at
drawn moments, among them pushes and goals towards the edge and the other mock-up. Masses, thrusts, delays,
tilt differ from what the rig states. Judged by truth: the emulated table has a rail, so who touches it would
have left. Results are appended to a file, one JSON object per sequence; those that are there are left out.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from fault_campaign import RADIUS_M, RIG, TOUCH_M

from groundstation.bus.envelope import Delivered
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Request
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveDemand
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

READY_S, SEQUENCE_S = 12.0, 60.0
LONGEST_PAUSE_S = 4.0
FULL_PUSH_N = 1000.0
WEIGHTS = {
    "go_to": 8, "push": 8, "resume": 4, "fly": 4, "brake": 2, "release": 2, "arm": 2, "land": 1, "stop": 1,
    "disarm": 0.5, "float_on": 1, "float_off": 0.5,
}  # fmt: skip
"""How often each action is asked for."""


@dataclass(frozen=True)
class Outcome:
    """What became of one sequence.

    Attributes:
        seed: Of everything that was drawn.
        asked: Number of requests.
        left_table: Mock-ups whose hull was beyond the rim, by truth.
        touched: Whether hulls touched, by truth.
        least_room_m: Between hull and rim, least of both; negative beyond.
        least_distance_m: Between the hulls.
        limited: Demands that the safety filter changed.
        demands: All demands.
        flown_s: Mock-up seconds in flight.
        faults: Raised, of both.
    """

    seed: int
    asked: int
    left_table: tuple[str, ...]
    touched: bool
    least_room_m: float
    least_distance_m: float
    limited: int
    demands: int
    flown_s: float
    faults: tuple[str, ...]


class Judge:
    """Sees the messages of one sequence."""

    KINDS = (ReferenceState, Supervision, Faults, ValveDemand)

    def __init__(self) -> None:
        self.places: dict[str, tuple[float, float]] = {}
        self.headings_rad: dict[str, float] = {}
        self.room_m: dict[str, float] = {}
        self.least_distance_m = math.inf
        self.limited = self.demands = 0
        self.faults: set[str] = set()

    def __call__(self, delivered: Delivered, now_ns: int) -> None:
        """A message, in the order of publication."""
        del now_ns
        message = delivered.payload
        if isinstance(message, ReferenceState):
            x_m, y_m = self.places[message.vehicle] = message.position_table_m
            self.headings_rad[message.vehicle] = message.heading_rad
            room_m = min(2.0 - abs(x_m), 1.5 - abs(y_m)) - RADIUS_M
            self.room_m[message.vehicle] = min(room_m, self.room_m.get(message.vehicle, math.inf))
            if len(self.places) == 2:
                apart_m = math.dist(*self.places.values()) - 2 * RADIUS_M
                self.least_distance_m = min(self.least_distance_m, apart_m)
        elif isinstance(message, ValveDemand):
            self.demands += 1
            self.limited += bool(message.limited_by)
        elif isinstance(message, Faults):
            self.faults.update(message.ids)


def rig_text(rng: np.random.Generator) -> str:
    """The rig of the fault campaign with a laboratory that differs from it."""
    tilt = rng.uniform(-4e-4, 4e-4, 2)
    text = RIG.replace("TILT_X", f"{tilt[0]:.2e}").replace("TILT_Y", f"{tilt[1]:.2e}")
    text = text.replace("starts_by_itself = false\n", "")
    head, *vehicles = text.split("[[laboratory.vehicles]]")
    drawn = [
        f"\nmass_kg = {rng.normal(11.0, 0.5):.3f}"
        f"\nvalves = {{ spread = {rng.uniform(0.0, 0.1):.3f}, sag = {rng.uniform(0.94, 1.0):.3f}, "
        f"open_delay_s = {rng.normal(0.006, 0.0005):.5f}, tank_impulse_n_s = 5000.0 }}{vehicle}"
        for vehicle in vehicles
    ]
    return "[[laboratory.vehicles]]".join((head, *drawn))


class HostileHand(Node):
    """Asks for one thing after the other; knows where both mock-ups are, and half of its pushes aim.

    Args:
        rng: Draws everything.
        judge: Knows the truth.
    """

    inputs = (Ack,)
    outputs = (Request,)

    def __init__(self, rng: np.random.Generator, judge: Judge) -> None:
        super().__init__("", 20_000_000)
        self._rng, self._judge = rng, judge
        self._due_s = READY_S
        self.asked = 0

    def receive(self, message: Message, now_ns: int) -> Iterable[Message]:
        del message, now_ns
        return ()

    def tick(self, now_ns: int) -> Iterable[Message]:
        while self._due_s <= now_ns * 1e-9:
            self._due_s += float(
                self._rng.choice((self._rng.uniform(0.02, 0.3), self._rng.uniform(0.3, LONGEST_PAUSE_S)))
            )
            self.asked += 1
            yield self._request(now_ns)

    def _request(self, now_ns: int) -> Request:
        rng, names, weights = self._rng, list(WEIGHTS), np.array(list(WEIGHTS.values()))
        vehicle = str(rng.choice(("alpha", "beta")))
        action = str(rng.choice(names, p=weights / weights.sum()))
        arguments = {"go_to": self._goal, "push": self._push}.get(action, lambda _: {})(vehicle)
        author = str(rng.choice(("anna", "boris")))
        return Request(now_ns, vehicle, self.asked, author, action, json.dumps(arguments))

    def _aim(self, vehicle: str) -> tuple[float, float]:
        """The other mock-up, or the nearest place of the rim."""
        x_m, y_m = self._judge.places[vehicle]
        if self._rng.random() < 0.6:
            return next(place for name, place in self._judge.places.items() if name != vehicle)
        if 2.0 - abs(x_m) < 1.5 - abs(y_m):
            return math.copysign(2.0, x_m), y_m
        return x_m, math.copysign(1.5, y_m)

    def _goal(self, vehicle: str) -> dict[str, float]:
        rng = self._rng
        x_m, y_m = float(rng.uniform(-1.8, 1.8)), float(rng.uniform(-1.3, 1.3))
        if rng.random() < 0.4:  # beyond the other one, through it
            here, there = self._judge.places[vehicle], self._aim(vehicle)
            x_m = min(max(2.0 * there[0] - here[0], -1.79), 1.79)
            y_m = min(max(2.0 * there[1] - here[1], -1.29), 1.29)
        return {"x_m": x_m, "y_m": y_m, "heading_rad": float(rng.uniform(-3.0, 3.0))}

    def _push(self, vehicle: str) -> dict[str, float]:
        rng = self._rng
        direction = float(rng.uniform(-math.pi, math.pi))
        if rng.random() < 0.5:
            here, there = self._judge.places[vehicle], self._aim(vehicle)
            aim = math.atan2(there[1] - here[1], there[0] - here[0])
            direction = aim - self._judge.headings_rad[vehicle]
        force = FULL_PUSH_N if rng.random() < 0.7 else float(rng.uniform(0.0, 0.5))
        return {
            "force_x_n": force * math.cos(direction),
            "force_y_n": force * math.sin(direction),
            "torque_nm": float(rng.choice((0.0, 0.0, rng.normal(0.0, 0.1), FULL_PUSH_N))),
            "span_s": float(rng.uniform(0.2, 10.0)),
        }


def fly(seed: int) -> Outcome:
    """Fly one sequence."""
    rng = np.random.default_rng([seed, 12])
    judge = Judge()
    text = rig_text(rng)
    hand = HostileHand(rng, judge)
    runner = make_runner(
        parse_rig(text, Path("hostile.toml")), seed, [judge], extra_nodes=[hand], journaled=False
    )
    try:
        runner.run(round((READY_S + SEQUENCE_S) * 1e9))
    finally:
        runner.close()
    return Outcome(
        seed,
        hand.asked,
        tuple(name for name, room_m in judge.room_m.items() if room_m < TOUCH_M),
        judge.least_distance_m < TOUCH_M,
        min(judge.room_m.values()),
        judge.least_distance_m,
        judge.limited,
        judge.demands,
        0.1 * judge.demands,
        tuple(sorted(judge.faults)),
    )


def main() -> int:
    """Fly what is missing; 1 if a mock-up left the table or touched the other one."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--out", type=Path, default=Path("hostile_commands.jsonl"))
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    done = [json.loads(line) for line in given.out.read_text().splitlines()] if given.out.exists() else []
    known = {row["seed"] for row in done}
    missing = [seed for seed in range(1, given.seeds + 1) if seed not in known]
    with ProcessPoolExecutor(given.jobs) as pool, given.out.open("a") as file:
        for number, outcome in enumerate(pool.map(fly, missing), 1):
            row = asdict(outcome)
            done.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
            sys.stderr.write(f"\r{number} of {len(missing)} sequences ")
    sys.stderr.write("\n")
    return report(done)


def report(rows: list[dict]) -> int:
    """Print what was found; 1 if a promise was broken."""
    left = [row["seed"] for row in rows if row["left_table"]]
    touched = [row["seed"] for row in rows if row["touched"]]
    limited = sum(row["limited"] for row in rows) / max(1, sum(row["demands"] for row in rows))
    room_m = min(row["least_room_m"] for row in rows)
    apart_m = min(row["least_distance_m"] for row in rows)
    print(
        f"{len(rows)} sequences of {SEQUENCE_S:g} s: left the table {len(left)} {left}, "
        f"touched {len(touched)} {touched}; least room to the rim {1e3 * room_m:.0f} mm, "
        f"least distance {1e3 * apart_m:.0f} mm; {limited:.0%} of the demands limited"
    )
    return int(bool(left or touched))


if __name__ == "__main__":
    sys.exit(main())
