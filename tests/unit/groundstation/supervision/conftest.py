"""Two mock-ups of these tests' own, not the firmware emulator's.

One floats: pulses in, IMU samples out. One is made of what a supervisor sees of it: all is fresh and well
unless a test says otherwise.
"""

import math
import sys
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from groundstation.control.keep_in import rectangle
from groundstation.control.state import ControlState
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.supervision.sightings import NodeSeen, Seen, Sightings
from groundstation.supervision.supervisor import Supervisor

MODEL = VehicleModel(11.0, 0.25, square_of_eight())
ARM_M = (0.03151, -0.02122)
PERIOD_MS = 100
DEFAULT = {"gyro": 6.7e-5, "acc": 6.5e-5, "gyro_hz": 0.0, "acc_hz": 0.0}
DATASHEET = {"gyro": 1.75e-3, "acc": 6.9e-5, "gyro_hz": 40.0, "acc_hz": 18.0}


@dataclass
class Truth:
    """How this mock-up differs from the rig, and what breaks; spans in ms."""

    gains: np.ndarray
    mass: float = 1.0
    inertia: float = 1.0
    centre_m: tuple[float, float] = (0.0, 0.0)
    open_ms: float | np.ndarray = 6.0  # one for all valves, or of each
    close_ms: float | np.ndarray = 5.0
    rise_ms: float = 4.0
    sag: float = 0.97
    zero: tuple[float, float] = (0.0, 0.0)
    closed: dict[int, float] = field(default_factory=dict)  # valve: from when
    scale: dict[int, tuple[float, ...]] = field(default_factory=dict)  # valve: from when, factor, until
    open: dict[int, tuple[float, float]] = field(default_factory=dict)  # valve: from when, share
    pulsing: dict[int, tuple[float, int, int]] = field(default_factory=dict)  # from when, on ms, period ms
    push: tuple[float, float, float, float] | None = None  # from, to, fx, fy (N, body)
    shift: tuple[float, float, float] | None = None  # from, x, y
    late_ms: np.ndarray | None = None  # of each period: how late its command reaches the valves

    @classmethod
    def drawn(cls, rng, **more):
        """A healthy one: 15 % of thrust per valve, 10 % of mass and inertia, delays, lever, zero."""
        return cls(
            gains=rng.uniform(0.85, 1.15, 8),
            mass=rng.uniform(0.9, 1.1),
            inertia=rng.uniform(0.9, 1.1),
            centre_m=tuple(rng.uniform(-0.005, 0.005, 2)),
            open_ms=rng.uniform(5.0, 7.0),
            close_ms=rng.uniform(4.0, 6.0),
            rise_ms=rng.uniform(3.0, 5.0),
            sag=rng.uniform(0.94, 1.0),
            zero=tuple(rng.uniform(-0.004, 0.004, 2)),
            **more,
        )


def commands(rng, periods, truth, busy=0.6):
    """On-times of eight valves per period; they keep the turning small, as a controller does."""
    table = MODEL.effectiveness()
    rate, chosen = 0.0, np.zeros((periods, 8), dtype=int)
    velocity = np.zeros(2)
    for row in chosen:
        for axis in range(2):
            want = 0.0
            if rng.random() < busy:
                want = rng.choice((-1.0, 1.0)) if rng.random() < 0.5 else -np.sign(velocity[axis])
            if want:
                first = 4 * axis + (0 if want > 0 else 2)
                on = int(rng.choice((12, 20, 35, 60, 100)))
                row[first : first + 2] = on
        turn = -0.25 * rate / 0.1 / 2.0 + rng.normal(0.0, 0.05)  # rad/s^2
        pair = rng.integers(2)
        valves = [v for v in (4 * pair, 4 * pair + 1, 4 * pair + 2, 4 * pair + 3) if table[2, v] * turn > 0]
        on = min(100, int(abs(turn) * 0.25 / 0.066 * 100))
        if on >= 10:
            for valve in valves:
                row[valve] = min(100, max(row[valve], on))
        impulse = table @ (row * truth.gains * 1e-3)
        rate += impulse[2] / 0.25
        velocity += impulse[:2] / 11.0
    return chosen


def fly(detector, rng, truth, chosen, *, noise=DEFAULT, period_ms=4, order=None):
    """Feed a detector with what was commanded and felt; yields (time in s, findings) where they change.

    The detector numbers its valves by `order`, if one is given.
    """
    steps = chosen.shape[0] * PERIOD_MS
    felt = np.zeros((steps, 8))
    start = np.arange(chosen.shape[0]) * PERIOD_MS
    if truth.late_ms is not None:
        start = start + truth.late_ms
    grid = np.arange(steps)
    open_ms, close_ms = np.broadcast_to(truth.open_ms, 8), np.broadcast_to(truth.close_ms, 8)
    for valve in range(8):
        on = chosen[:, valve]
        share = np.zeros(steps + 300)
        for first, length in zip(start[on > 0], on[on > 0], strict=True):
            is_open = first and share[first + 1] > 0
            begin = first + (0.0 if is_open else open_ms[valve] + rng.normal(0.0, 0.5))
            end = first + length + close_ms[valve]
            low, high = math.floor(begin), math.floor(end)
            share[first + math.ceil(close_ms[valve]) :] = 0.0
            share[low + 1 : high] = 1.0
            share[low] = max(share[low], 1 - begin + low)
            share[high] = end - high
        share = share[:steps]
        if valve in truth.closed:
            share[grid >= truth.closed[valve]] = 0.0
        if valve in truth.scale:
            since, factor, until = (*truth.scale[valve], math.inf)[:3]
            share[(grid >= since) & (grid < until)] *= factor
        if valve in truth.open:
            since, least = truth.open[valve]
            share = np.where(grid >= since, np.maximum(share, least), share)
        if valve in truth.pulsing:
            since, on_ms, every = truth.pulsing[valve]
            share = np.where((grid >= since) & ((grid - since) % every < on_ms), 1.0, share)
        felt[:, valve] = share
    felt = lagged(felt, truth.rise_ms)
    felt *= (truth.sag ** np.maximum(0.0, felt.sum(1) - 1.0))[:, None]
    table = MODEL.effectiveness() * truth.gains
    table[2] -= truth.centre_m[0] * table[1] - truth.centre_m[1] * table[0]
    wrench = felt @ table.T
    if truth.push is not None:
        first, last, fx, fy = truth.push
        wrench[int(first) : int(last), 0] += fx
        wrench[int(first) : int(last), 1] += fy
    turn = wrench[:, 2] / (MODEL.inertia_kg_m2 * truth.inertia)
    rate = np.cumsum(turn) * 1e-3
    rate -= lagged(rate, 60_000.0)  # whoever steers takes out what adds up over minutes
    arm = np.array(ARM_M) - truth.centre_m
    force = wrench[:, :2] / (MODEL.mass_kg * truth.mass)
    force[:, 0] += -turn * arm[1] - rate**2 * arm[0] + truth.zero[0]
    force[:, 1] += turn * arm[0] - rate**2 * arm[1] + truth.zero[1]
    if truth.shift is not None:
        force[int(truth.shift[0]) :] += truth.shift[1:]
    rate = rate + noise["gyro"] * math.sqrt(1000.0) * rng.standard_normal(steps)
    force = force + noise["acc"] * math.sqrt(1000.0) * rng.standard_normal((steps, 2))
    if noise["gyro_hz"]:
        rate = lagged(rate, 500.0 / math.pi / noise["gyro_hz"])
    if noise["acc_hz"]:
        force = lagged(force, 500.0 / math.pi / noise["acc_hz"])
    count = steps // period_ms
    rates = rate[: count * period_ms].reshape(count, -1).mean(1).tolist()
    forces = force[: count * period_ms].reshape(count, -1, 2).mean(1).tolist()
    window_s = period_ms * 1e-3
    ordered = chosen if order is None else chosen[:, order]
    period, rows = -1, [bytes(row) for row in ordered.tolist()]
    for sample in range(count):
        end_ms = (sample + 1) * period_ms
        while (period + 1) * PERIOD_MS < end_ms:
            period += 1
            detector.command(period * PERIOD_MS * 1_000_000, (period + 1) % 16, rows[period])
        since_ms = end_ms - period * PERIOD_MS
        if truth.late_ms is not None and 10 < since_ms <= truth.late_ms[period] and end_ms % 20 == 0:
            detector.skip_late_command()  # a status, each 20 ms, names the command before
        stamp_ns = end_ms * 1_000_000
        if detector.sample(stamp_ns, window_s, rates[sample], tuple(forces[sample])):
            yield end_ms * 1e-3, detector.findings(stamp_ns)


def lagged(values, tau_ms):
    """First-order low-pass of 1 ms samples."""
    from scipy.signal import lfilter

    left = math.exp(-1.0 / tau_ms)
    return lfilter([1.0 - left], [1.0, -left], values, axis=0)


def make_detector(noise=DEFAULT, model=MODEL, arm=ARM_M):
    """As a rig would configure it."""
    from groundstation.supervision.thrust_fit import FitConfig
    from groundstation.supervision.valve_consistency import ValveConsistency, ValveConsistencyConfig

    lag = [1.0 / (2.0 * math.pi * hz) if hz else 0.0 for hz in (noise["acc_hz"], noise["gyro_hz"])]
    fit = FitConfig(
        imu_position_body_m=arm,
        gyro_density_rad_s_rthz=noise["gyro"],
        acc_density_m_s2_rthz=noise["acc"],
    )
    return ValveConsistency(model, ValveConsistencyConfig(fit=fit, acc_lag_s=lag[0], gyro_lag_s=lag[1]))


@pytest.fixture
def air():
    """This module: mock-ups, how they fly, and a detector for them."""
    return sys.modules[__name__]


PERIOD_NS = 20_000_000
PERSON = "anna"


def seen(
    now_ns, position=(0.0, 0.0), velocity=(0.0, 0.0), rate_rad_s=0.0, status="flying", sigma=(0.001,) * 3
):
    return Seen(now_ns, ControlState(position, velocity, 0.0, rate_rad_s), status, sigma)


def node(now_ns, **changes):
    usual = NodeSeen(now_ns, armed=False, floating=False, dead_man=False, pressure_pa=100e5, faults=0)
    return replace(usual, **changes)


def sightings(began_ns=0, **changes):
    """A table of 4 m by 3 m, less 0.2 m all round; braking takes 0.05 m/s off in a second."""
    return Sightings(rectangle((4.0, 3.0), margin_m=0.2), 0.05, 0.15, began_ns, **changes)


class Vehicle:
    """Plays the other side of a supervisor: what is ordered of the air is done within a period.

    Attributes:
        silent: What publishes nothing: of ``state``, ``node``, ``detector``, ``demand``.
        velocity: True one; braking takes it away.
        air_obeys: The valve node carries out orders.
    """

    def __init__(self, *, starts_by_itself=True, rest_s=8.0):
        self.sightings = sightings()
        self.supervisor = Supervisor(
            self.sightings, rest_s=rest_s, period_ns=PERIOD_NS, starts_by_itself=starts_by_itself
        )
        self.sightings.rest_s = rest_s
        self.sightings.fix_age_s = 0.5
        self.sightings.agreeing = 2
        self.now_ns = 0
        self.silent = set()
        self.findings = {}
        self.position, self.velocity = (0.0, 0.0), (0.0, 0.0)
        self.status, self.sigma = "flying", (0.001,) * 3
        self.floating = False
        self.air_obeys = True
        self.modes = []

    @property
    def mode(self):
        return self.supervisor.mode

    @property
    def ruling(self):
        return self.supervisor.ruling()

    @property
    def faults(self):
        return [row.fault.id for row in self.supervisor.board]

    def step(self):
        """A period passes."""
        self.now_ns += PERIOD_NS
        now_ns, ruling, seen_now = self.now_ns, self.ruling, self.sightings
        if self.air_obeys:
            self.floating = ruling.is_air_on
        if "state" not in self.silent:
            seen_now.see_own(seen(now_ns, self.position, self.velocity, 0.0, self.status, self.sigma))
        if "node" not in self.silent:
            seen_now.node = node(now_ns, armed=ruling.may_open, floating=self.floating)
        if "detector" not in self.silent:
            seen_now.findings, seen_now.findings_ns = dict(self.findings), now_ns
        if "demand" not in self.silent:
            seen_now.demand_ns = now_ns
        changed = self.supervisor.look(now_ns)
        if not self.modes or self.modes[-1] is not self.mode:
            self.modes.append(self.mode)
        return changed

    def run(self, span_s):
        """Time passes; returns the modes that were gone through."""
        self.modes = []
        for _ in range(round(span_s * 1e9) // PERIOD_NS):
            self.step()
        return [str(mode) for mode in self.modes]

    def ask(self, event, override=""):
        return self.supervisor.request(event, PERSON, self.now_ns, override)

    def press(self, press_id, author=PERSON):
        return self.supervisor.press(author, press_id, self.now_ns)

    def fly(self):
        """Take off, from the beginning."""
        modes = self.run(1.0)
        assert modes == ["armed", "flying"]
        return self


@pytest.fixture
def vehicle():
    return Vehicle()


@pytest.fixture
def flying():
    return Vehicle().fly()


@pytest.fixture
def landed():
    vehicle = Vehicle(starts_by_itself=False)
    vehicle.run(0.1)
    return vehicle


@pytest.fixture(name="seen")
def seen_fixture():
    return seen


@pytest.fixture(name="node")
def node_fixture():
    return node


@pytest.fixture(name="sightings")
def sightings_fixture():
    return sightings
