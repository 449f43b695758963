"""Every failure that the emulator can inject, in closed loop and virtual time, over many seeds.

Each flight: alpha flies to and fro, beta stands on the table as a neighbour; a failure with drawn parameters
befalls alpha at a drawn moment and stays. Judged by truth and by what was commanded, not by what the station
believes. Results are appended to a file, one JSON object per flight; flights that are there are left out, so
that a campaign which was ended goes on where it was.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from itertools import repeat
from pathlib import Path

import numpy as np

from groundstation.bus.envelope import Delivered
from groundstation.declarations.message import Message
from groundstation.declarations.request import Request
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveCommand, ValveStatus
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner
from groundstation.supervision.faults import FAULTS

EARLIEST_S, LATEST_S, AFTER_S = 14.0, 18.0, 26.0
LEG_S = 5.0
RADIUS_M, TOUCH_M = 0.2, 0.001
"""Of a mock-up; the emulated table has a rail, so who comes as near to it would have left."""
ARMED_LATE_NS = 100_000_000
AFLOAT_NS = 300_000_000
"""So long after it was disarmed the air may still be on: the order, the report."""
HEALTHY, PUSHED, PUSH_S = "healthy", "pushed", 0.3
LARGE_TANK = "valves = { tank_impulse_n_s = 5000.0 }"
RIG = """
name = "fault campaign"
valve_bus = "laboratory:valve_bus"
table = { x_min_m = -2.0, x_max_m = 2.0, y_min_m = -1.5, y_max_m = 1.5 }

[mock_ups.standard.imu]
baud = 250000
averaging = 4
ftdi_latency_s = 0.001
position_body_m = [0.03151, -0.02122]
gyro_density_rad_s_rthz = 6.7e-5
acc_density_m_s2_rthz = 6.5e-5

[mock_ups.standard.fusion]
rest_s = 6.0

[mock_ups.standard.control]
controller = "go_to"

[vehicles.alpha]
mock_up = "standard"
bus_index = 0
imu = "laboratory:alpha/imu"
imu_serial_number = 1
fixes = "laboratory:alpha/fixes"
reference = "laboratory:alpha/reference"
hold = { x_m = -0.9, y_m = -0.3, heading_deg = 0.0 }

[vehicles.beta]
mock_up = "standard"
bus_index = 1
imu = "laboratory:beta/imu"
fixes = "laboratory:beta/fixes"
reference = "laboratory:beta/reference"
starts_by_itself = false
hold = { x_m = 0.6, y_m = 0.0, heading_deg = 90.0 }

[laboratory]
name = "emulator"
table = { bounds_m = [-2.0, 2.0, -1.5, 1.5], tilt_rad = [TILT_X, TILT_Y] }

[[laboratory.vehicles]]
name = "alpha"
start_m = [-0.9, -0.3]
imu = { model = "published", averaging = 4, ftdi_latency_ms = 1 }
camera = { source = "fixes", rate_hz = 15.0, delay_s = 0.015 }

[[laboratory.vehicles]]
name = "beta"
start_m = [0.6, 0.0]
start_heading_deg = 90.0
imu = { model = "published", averaging = 4, ftdi_latency_ms = 1 }
camera = { source = "fixes", rate_hz = 15.0, delay_s = 0.015 }
"""


@dataclass(frozen=True)
class Outcome:
    """What became of one flight; times in s.

    Attributes:
        failure: What was injected.
        seed: Of everything that was drawn.
        start_s: When it began.
        fault: First fault of those that it should raise; empty if none came.
        found_after_s: From its beginning to the event; NaN if none came.
        commanded_s: On-time commanded to the valve that failed, until the event.
        false_alarms: Faults raised before it began.
        expected: Faults raised after it that it may raise.
        others: Faults raised after it that it should not raise.
        left_table: By truth.
        hit_neighbour: By truth.
        floated_unarmed: Longer than the order takes.
        open_when_disarmed: A valve was commanded open over 100 ms after the guard was disarmed.
        excursion_m: Farthest from where it was when it began, less the way to its goal.
        mode: At the end.
    """

    failure: str
    seed: int
    start_s: float
    fault: str
    found_after_s: float
    commanded_s: float
    false_alarms: tuple[str, ...]
    expected: tuple[str, ...]
    others: tuple[str, ...]
    left_table: bool
    hit_neighbour: bool
    floated_unarmed: bool
    open_when_disarmed: bool
    excursion_m: float
    mode: str


class Judge:
    """Sees the messages of one flight."""

    KINDS = (ReferenceState, Supervision, Faults, ValveCommand, ValveStatus)

    def __init__(self, failure: str, start_s: float, valve: int | None) -> None:
        self.failure, self.start_ns, self.valve = failure, round(start_s * 1e9), valve
        self.expected = {row.id for row in FAULTS.values() if failure in row.failures}
        self.found: dict[str, int] = {}
        self.before: set[str] = set()
        self.left_table = self.hit_neighbour = self.floated_unarmed = self.open_when_disarmed = False
        self.mode = ""
        self.commanded_ms = 0.0
        self._may_open = False
        self._disarmed_ns = self._unarmed_ns = 0
        self._places: dict[str, tuple[float, float]] = {}
        self._origin: tuple[float, float] | None = None
        self.excursion_m = 0.0
        self._command_ns = 0

    def __call__(self, delivered: Delivered, now_ns: int) -> None:
        """A message of the flight, in the order in which they were published."""
        message = delivered.payload
        if isinstance(message, ReferenceState):
            self._place(message, now_ns)
        elif isinstance(message, Message) and message.vehicle == "alpha":
            self._judge(message, now_ns)

    def _judge(self, message: Message, now_ns: int) -> None:
        match message:
            case Supervision():
                if self._may_open and not message.may_open:
                    self._disarmed_ns = now_ns
                self._may_open = message.may_open
                self.mode = message.mode
            case Faults():
                for fault in message.ids:
                    if now_ns < self.start_ns:
                        self.before.add(fault)
                    else:
                        self.found.setdefault(fault, now_ns)
            case ValveCommand():
                late = not self._may_open and now_ns - self._disarmed_ns > ARMED_LATE_NS
                self.open_when_disarmed |= late and any(message.on_time_ms)
                if (
                    self.valve is not None
                    and now_ns >= self.start_ns
                    and not self.expected & self.found.keys()
                ):
                    span_ms = (now_ns - self._command_ns) * 1e-6
                    self.commanded_ms += min(float(message.on_time_ms[self.valve]), span_ms)
                self._command_ns = now_ns
            case ValveStatus():
                if not message.floating or message.armed:
                    self._unarmed_ns = now_ns
                self.floated_unarmed |= now_ns - self._unarmed_ns > AFLOAT_NS

    def _place(self, truth: ReferenceState, now_ns: int) -> None:
        x_m, y_m = self._places[truth.vehicle] = truth.position_table_m
        if len(self._places) == 2:
            self.hit_neighbour |= math.dist(*self._places.values()) < 2 * RADIUS_M + TOUCH_M
        if truth.vehicle != "alpha":
            return
        room_m = min(2.0 - abs(x_m), 1.5 - abs(y_m)) - RADIUS_M
        self.left_table |= room_m < TOUCH_M
        if now_ns >= self.start_ns:
            self._origin = self._origin or (x_m, y_m)
            self.excursion_m = max(self.excursion_m, math.dist(self._origin, (x_m, y_m)))

    def outcome(self, seed: int) -> Outcome:
        """What was seen."""
        hits = {fault: ns for fault, ns in self.found.items() if fault in self.expected}
        first = min(hits, key=lambda fault: hits[fault]) if hits else ""
        return Outcome(
            self.failure,
            seed,
            self.start_ns * 1e-9,
            first,
            (hits[first] - self.start_ns) * 1e-9 if first else math.nan,
            self.commanded_ms * 1e-3,
            tuple(sorted(self.before)),
            tuple(sorted(hits)),
            tuple(sorted(self.found.keys() - self.expected)),
            self.left_table,
            self.hit_neighbour,
            self.floated_unarmed,
            self.open_when_disarmed,
            self.excursion_m,
            str(self.mode),
        )


def parameters_of(failure: str, rng: np.random.Generator) -> dict[str, float]:
    """Parameters of a failure, drawn where the place matters and large enough to matter."""
    valve = float(rng.integers(8))
    sign = float(rng.choice((-1.0, 1.0)))
    return {
        "stuck_open_valve": {"valve": valve},
        "stuck_closed_valve": {"valve": valve},
        "leaking_valve": {"valve": valve, "fraction": 0.4},
        "weak_valve": {"valve": valve, "fraction": 0.3},
        "pulsing_valve": {"valve": valve, "period_s": 0.4, "on_s": 0.06},
        "shifted_imu": {"gyro_deg_s": 1.0 * sign, "acc_x_mg": 5.0 * sign},
        "pushed": {"force_x_n": 2.0 * sign, "torque_nm": 0.1},
        "lost_bytes": {"probability_per_byte": 1.0},
        "wrong_fixes": {"dx_m": 0.1 * sign},
        "flooded_bus": {"rate_hz": 2000.0},
    }.get(failure, {})


def drawn(failure: str, seed: int) -> tuple[np.random.Generator, str, dict[str, float]]:
    """What a seed decides: the generator for the rest, the rig, the parameters of the failure."""
    rng = np.random.default_rng([seed, *failure.encode()])
    start_s = float(rng.uniform(EARLIEST_S, LATEST_S))
    tilt = rng.uniform(-3e-4, 3e-4, 2)
    text = RIG.replace("TILT_X", f"{tilt[0]:.2e}").replace("TILT_Y", f"{tilt[1]:.2e}")
    if failure == HEALTHY:  # a quarter of an hour of this empties a tank, which is no false alarm
        text = text.replace("start_m = [-0.9, -0.3]", f"start_m = [-0.9, -0.3]\n{LARGE_TANK}")
    given = parameters_of(failure, rng)
    return rng, text, {"start_s": start_s, **given}


def valve_of(given: dict[str, float]) -> int | None:
    """Valve that fails; None where none does."""
    return int(given["valve"]) if "valve" in given else None


def fly(failure: str, seed: int, after_s: float = AFTER_S) -> Outcome:
    """Fly once, for so long after the failure."""
    rng, text, given = drawn(failure, seed)
    start_s = given.pop("start_s")
    if failure != HEALTHY:
        inner = ", ".join(f"{name} = {value}" for name, value in given.items())
        lasts = f"end_s = {start_s + PUSH_S:.3f}\n" if failure == PUSHED else ""
        text += (
            f'\n[[laboratory.failures]]\nkind = "{failure}"\nvehicle = "alpha"\nstart_s = {start_s:.3f}\n'
            f"{lasts}parameters = {{ {inner} }}\n"
        )
    judge = Judge(failure, start_s, valve_of(given))
    runner = make_runner(
        parse_rig(text, Path("campaign.toml")),
        seed,
        [judge],
        requests=_laps(rng, start_s + after_s),
        journaled=False,
    )
    try:
        runner.run(round((start_s + after_s) * 1e9))
    finally:
        runner.close()
    return judge.outcome(seed)


def _laps(rng: np.random.Generator, until_s: float) -> Iterator[Request]:
    """To and fro past the neighbour, at the speed that the controller chooses."""
    for number in range(int((until_s - 10.0) / LEG_S)):
        stamp_ns = round((10.0 + LEG_S * number) * 1e9)
        yield Request(stamp_ns, "alpha", number + 1, "campaign", "go_to", json.dumps(goal_of(number, rng)))


def goal_of(number: int, rng: np.random.Generator) -> dict[str, float]:
    """End of a leg: arguments of `go_to`."""
    side = 1.0 if number % 2 else -1.0
    return {
        "x_m": 0.1 if number % 2 else -0.9,
        "y_m": side * float(rng.uniform(0.2, 0.5)),
        "heading_rad": float(rng.uniform(-3.0, 3.0)),
    }


def failures() -> tuple[str, ...]:
    """Every failure that some row of the table of faults names."""
    unrendered = {"torn_camera", "dead_tilt", "false_lights"}  # see the rendered rigs' own tests
    return tuple(sorted({name for row in FAULTS.values() for name in row.failures} - unrendered))


def main() -> int:
    """Run what is asked for; 1 if a flight broke a promise."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", nargs="*", default=[], help="failures; all if none is named")
    parser.add_argument("--out", type=Path, default=Path("fault_campaign.jsonl"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--after", type=float, default=AFTER_S, help="s of flight after the failure begins")
    given = parser.parse_args()
    done = [json.loads(line) for line in given.out.read_text().splitlines()] if given.out.exists() else []
    names = given.only or (*failures(), HEALTHY)
    wanted = [(name, seed) for name in names for seed in range(1, given.seeds + 1)]
    missing = [pair for pair in wanted if not any((row["failure"], row["seed"]) == pair for row in done)]
    with ProcessPoolExecutor(given.jobs) as pool, given.out.open("a") as file:
        for number, outcome in enumerate(
            pool.map(fly, *zip(*missing, strict=True), repeat(given.after)) if missing else (), 1
        ):
            row = asdict(outcome)
            done.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
            sys.stderr.write(f"\r{number} of {len(missing)} flights ")
    sys.stderr.write("\n")
    rows = [row for row in done if row["failure"] in names]
    return report(rows)


def report(rows: list[dict[str, object]]) -> int:
    """Print a row per failure; 1 if a promise was broken."""
    broken = 0
    print(f"{'failure':20} {'found':>7} {'95 % s':>7} {'excursion m':>11}  broken promises, other faults")
    for name in sorted({str(row["failure"]) for row in rows}):
        own = [row for row in rows if row["failure"] == name]
        times = [float(str(row["found_after_s"])) for row in own if row["fault"]]
        promises = [
            f"{key} x{count}"
            for key in ("left_table", "hit_neighbour", "floated_unarmed", "open_when_disarmed")
            if (count := sum(bool(row[key]) for row in own))
        ]
        alarms = [row["false_alarms"] for row in own if row["false_alarms"]]
        if name == HEALTHY:
            alarms += [row["others"] for row in own if row["others"]]
        broken += bool(promises) or bool(alarms)
        worst = max(float(str(row["excursion_m"])) for row in own)
        late = f"{np.quantile(times, 0.95):7.2f}" if times else "      -"
        note = " ".join(promises) + (f" FALSE ALARMS {alarms}" if alarms else "")
        print(f"{name:20} {len(times):3}/{len(own):<3} {late} {worst:11.2f}  {note}")
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main())
