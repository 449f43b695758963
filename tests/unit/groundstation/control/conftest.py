"""A mock-up of its own for these tests: double integrator, slow valves, a late and noisy state estimate.

Independent of the firmware emulator on purpose; every number that a test asserts is explained there.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from groundstation.control.allocation import Allocator
from groundstation.control.averaging import RateMean
from groundstation.control.controller import NO_NEIGHBOURS, Controller
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.state import NO_WRENCH, ControlState, Goal
from groundstation.control.valve_health import HEALTHY, ValveHealth
from groundstation.control.vehicle import VehicleModel, square_of_eight

STEP_S = 0.001


@dataclass(frozen=True)
class World:
    """What the controller has to live with; defaults are the stated test conditions."""

    slope_table_m_s2: tuple[float, float] = (0.003, 0.0)  # 0.3 mrad of table tilt
    disturbance_torque_nm: float = 0.0005
    open_delay_s: float = 0.006
    close_delay_s: float = 0.005
    thrust_spread: float = 0.05  # per valve, one sigma
    sag: float = 1.0  # of thrust per further open valve
    broken: Mapping[int, ValveHealth] = field(default_factory=dict)
    broken_from_s: float = 20.0
    found_after_s: float = 0.3  # the modulator is told of it then
    latency_s: float = 0.040  # state age when the controller reads it
    fix_period_s: float = 0.65  # star tracker busy 0.6 s per frame
    fix_delay_s: float = 0.6
    fix_sigma_m: float = 0.001
    fix_sigma_rad: float = math.radians(0.05)
    speed_sigma_m_s: float = 0.0015  # velocity error of the fusion between fixes
    rate_noise_sigma_rad_s: float = math.radians(0.79)  # ADIS16100 behind its 40 Hz filter
    rate_noise_pole_rad_s: float = 2 * math.pi * 40.0


@dataclass
class Flight:
    """Truth and bookkeeping of one simulated flight; arrays have one row a period."""

    time_s: list[float] = field(default_factory=list)
    pose: list[tuple[float, float, float]] = field(default_factory=list)
    velocity: list[tuple[float, float, float]] = field(default_factory=list)
    gas_n_s: float = 0.0
    pulses: int = 0
    shortest_ms: int = 127

    def errors(self, goal: Goal, after_s: float) -> tuple[float, float, float]:
        """Position RMS [m], heading RMS [rad], largest position error [m] after settling."""
        pose = np.array(self.pose)[np.array(self.time_s) >= after_s]
        distance = np.hypot(pose[:, 0] - goal.position_table_m[0], pose[:, 1] - goal.position_table_m[1])
        turn = np.remainder(pose[:, 2] - goal.heading_rad + math.pi, 2 * math.pi) - math.pi
        return (
            float(np.sqrt((distance**2).mean())),
            float(np.sqrt((turn**2).mean())),
            float(distance.max()),
        )


class Estimator:
    """Truth made late and wrong as a fusion of gyro and late star fixes would.

    The error is that of the newest fix, carried on by integrating wrong velocity and the gyro's white
    noise since the fix's exposure; it jumps when a fix arrives.
    """

    def __init__(self, world: World, rng: np.random.Generator) -> None:
        self._world, self._rng = world, rng
        self._next_fix_s = 0.0
        self._fixes: list[tuple[float, np.ndarray]] = [(-1.0, self._draw())]
        self._rate_noise = 0.0
        self._heading_walk: list[float] = [0.0]

    def _draw(self) -> np.ndarray:
        world = self._world
        sigma = (
            world.fix_sigma_m,
            world.fix_sigma_m,
            world.fix_sigma_rad,
            world.speed_sigma_m_s,
            world.speed_sigma_m_s,
        )
        return self._rng.normal(0.0, sigma)

    def advance(self, now_s: float, steps: int) -> None:
        world = self._world
        pole = math.exp(-world.rate_noise_pole_rad_s * STEP_S)
        drive = self._rng.normal(0.0, world.rate_noise_sigma_rad_s * math.sqrt(1 - pole**2), steps)
        for value in drive.tolist():
            self._rate_noise = pole * self._rate_noise + value
            self._heading_walk.append(self._heading_walk[-1] + self._rate_noise * STEP_S)
        if now_s >= self._next_fix_s:
            self._fixes.append((now_s, self._draw()))
            self._next_fix_s = now_s + world.fix_period_s

    def state(self, now_s: float, pose: np.ndarray, velocity: np.ndarray) -> ControlState:
        arrived = [fix for fix in self._fixes if fix[0] + self._world.fix_delay_s <= now_s]
        exposure_s, error = (arrived or self._fixes)[-1]
        age_s = now_s - exposure_s
        since = max(0, len(self._heading_walk) - 1 - round(age_s / STEP_S))
        walk = self._heading_walk[-1] - self._heading_walk[since]
        return ControlState(
            (float(pose[0] + error[0] + error[3] * age_s), float(pose[1] + error[1] + error[4] * age_s)),
            (float(velocity[0] + error[3]), float(velocity[1] + error[4])),
            float(pose[2] + error[2] + walk),
            float(velocity[2] + self._rate_noise),
        )


def fly(
    controller: Controller,
    goal: Goal,
    *,
    seed: int = 1,
    duration_s: float = 60.0,
    world: World = World(),
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    start_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    pulse: PulseConfig = PulseConfig(),  # noqa: B008  frozen
    update_s: float = 0.02,
    averaged: bool = False,
    vehicle: VehicleModel | None = None,
    neighbours: Callable[[float], dict[str, ControlState]] | None = None,
) -> Flight:
    """Close the loop for a while; truth integrates in 1 ms steps.

    The controller is updated each `update_s`, or, if `averaged`, once a pulse period with the mean of the
    rates that came each `update_s`.
    """
    rng = np.random.default_rng(seed)
    vehicle = vehicle or VehicleModel(11.0, 0.25, square_of_eight())
    modulator = PulseModulator(Allocator(vehicle), pulse)
    estimator = Estimator(world, rng)
    columns = vehicle.effectiveness() * rng.normal(1.0, world.thrust_spread, len(vehicle.valves))
    inertia = np.array((vehicle.mass_kg, vehicle.mass_kg, vehicle.inertia_kg_m2))
    constant = np.array((*world.slope_table_m_s2, world.disturbance_torque_nm / vehicle.inertia_kg_m2))
    steps = round(pulse.period_s / STEP_S)
    instants = np.arange(steps) * STEP_S
    pose, velocity = np.array(start, dtype=float), np.array(start_velocity, dtype=float)
    late_steps = round(world.latency_s / STEP_S)
    poses, speeds = np.tile(pose, (late_steps + 1, 1)), np.tile(velocity, (late_steps + 1, 1))
    close_at_s = np.full(len(vehicle.valves), -1.0)  # from the start of the period
    rate_mean = RateMean()
    flight, wrench, pulses = Flight(), NO_WRENCH, None
    states = [world.broken.get(valve, HEALTHY) for valve in range(len(vehicle.valves))]
    is_told = False
    for count in range(round(duration_s / pulse.period_s)):
        now_s = count * pulse.period_s
        if world.broken and not is_told and now_s >= world.broken_from_s + world.found_after_s:
            is_told = True
            modulator.take_health(states)
        updates = round(pulse.period_s / update_s)
        for update in range(updates):
            # the updates since the last pulses, the newest last; each reads a state of `latency_s` ago
            back_s = pulse.period_s - (update + 1) * update_s
            estimator.advance(now_s - back_s, round(update_s / STEP_S))
            row = max(0, len(poses) - 1 - late_steps - round(back_s / STEP_S))
            rate_mean.add(estimator.state(now_s - back_s, poses[row], speeds[row]))
            if update + 1 < updates and averaged:
                continue
            state = rate_mean.take()
            assert state is not None
            wrench = controller.update(
                state,
                goal,
                pulse.period_s if averaged else update_s,
                applied=pulses.delivered if pulses else NO_WRENCH,
                neighbours=neighbours(now_s - back_s) if neighbours else NO_NEIGHBOURS,
            )
        pulses = modulator.update(wrench)
        on_s = np.array(pulses.on_time_ms) / 1000.0
        opens_s = np.where(close_at_s > 0.0, 0.0, world.open_delay_s)
        # a new command overwrites the old one: an open valve told 0 closes after its delay
        close_at_s = np.where(
            on_s > 0.0, on_s + world.close_delay_s, np.minimum(close_at_s, world.close_delay_s)
        )
        is_open = (instants[:, None] >= np.where(on_s > 0.0, opens_s, 0.0)) & (instants[:, None] < close_at_s)
        given = is_open.astype(float)
        if now_s >= world.broken_from_s:
            for valve, state in world.broken.items():
                given[:, valve] = np.where(is_open[:, valve], state.open_share, state.shut_share)
        given *= (world.sag ** np.maximum(0.0, given.sum(axis=1) - 1.0))[:, None]
        cosine, sine = math.cos(pose[2]), math.sin(pose[2])
        force = given @ columns.T @ np.array(((cosine, sine, 0.0), (-sine, cosine, 0.0), (0.0, 0.0, 1.0)))
        new_speeds = velocity + np.cumsum(force / inertia + constant, axis=0) * STEP_S
        new_poses = pose + np.cumsum(new_speeds, axis=0) * STEP_S
        poses = np.vstack([poses[-late_steps - 1 :], new_poses])
        speeds = np.vstack([speeds[-late_steps - 1 :], new_speeds])
        pose, velocity = poses[-1], speeds[-1]
        close_at_s = close_at_s - pulse.period_s
        flight.time_s.append(now_s + pulse.period_s)
        flight.pose.append(tuple(pose.tolist()))
        flight.velocity.append(tuple(velocity.tolist()))
        flight.gas_n_s += float((given * np.linalg.norm(columns[:2], axis=0)).sum()) * STEP_S
        fired = [on for on in pulses.on_time_ms if on]
        flight.pulses += len(fired)
        flight.shortest_ms = min([flight.shortest_ms, *fired])
    return flight


@pytest.fixture
def vehicle() -> VehicleModel:
    return VehicleModel(11.0, 0.25, square_of_eight())


@pytest.fixture(name="fly")
def fly_fixture() -> Callable[..., Flight]:
    return fly


@pytest.fixture
def world() -> Callable[..., World]:
    return lambda **changes: replace(World(), **changes)
