"""From the fit of the valves to what an emulated laboratory is told: forces, inertia, timing, drag, noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.laboratory.findings import Findings, Found
from calibration.laboratory.recorded_flight import RecordedFlight
from calibration.laboratory.thrust_course import Timing
from calibration.laboratory.valve_columns import (
    CLOSE,
    DRAG,
    FORCE,
    OPEN,
    RISE,
    SAG,
    TURN,
    TURN_DRAG,
    ValveModel,
)
from calibration.laboratory.valve_fit import DELAY_SIGMA_S, RISE_SIGMA_S, SAG_SIGMA, ValveFit
from drivers.imu_block.sensors import TILT_SCALE_M_S2
from drivers.valve_bus.messages import VALVES
from groundstation.declarations.rig import Rig
from groundstation.fusion.noise import lag_of_bandwidth
from groundstation.parts.imu.sections import ImuOfType

Array = NDArray[np.float64]

SAG_BELIEVED = 0.97
"""From which the search begins: what regulators of such mock-ups do."""
WELL_KNOWN = 0.10
"""A thrust is written if its sigma is below this share of it."""
DELAY_KNOWN_S, RISE_KNOWN_S = 0.003, 0.002
LEARNED = 0.5
"""Of what was thought possible before: a sigma above is not the flight's."""
FEWEST_OPENINGS = 10.0
SEEN_SIGMAS = 3.0
UNEVEN_LEVERS = 9.0
"""Mean square, in sigmas, of the levers about one inertia, that is worth a word."""


def model_of(rig: Rig, vehicle: str) -> ValveModel:
    """Return what a rig states about valves and sensors of a vehicle."""
    kind, imu = rig.type_of(vehicle), rig.of_type(vehicle, ImuOfType).imu
    body, valves = kind.model(), kind.valves
    force_x, force_y, torque = body.effectiveness()
    force_n = np.hypot(force_x, force_y)
    return ValveModel(
        np.column_stack([force_x, force_y]) / force_n[:, None],
        force_n / body.mass_kg,
        torque / body.inertia_kg_m2,
        imu.position_body_m,
        imu.position_sigma_m,
        Timing(valves.open_delay_s, valves.close_delay_s, valves.rise_s, SAG_BELIEVED),
        lag_of_bandwidth(imu.acc_bandwidth_hz),
        lag_of_bandwidth(imu.gyro_bandwidth_hz),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Pushes:
    """Forces over mass and turns over inertia with the scales of the sensors taken out.

    Attributes:
        value: (16,) forces, then turns.
        covariance: (16, 16).
    """

    value: Array
    covariance: Array


def pushes_of(
    fit: ValveFit, model: ValveModel, matrix: tuple[Array, Array], gyro_scale: tuple[float, float]
) -> Pushes:
    """Take the scales of the sensors out of what they read.

    Args:
        fit: The fit.
        model: Of the rig.
        matrix: Reading over force less one (xx, xy, yx, yy), and its covariance.
        gyro_scale: Reading over rate less one, and its variance.
    """
    x, y = model.direction.T
    along = np.column_stack([x * x, x * y, x * y, y * y])  # what the matrix adds along each force
    scale = np.concatenate([1.0 + along @ matrix[0], np.full(VALVES, 1.0 + gyro_scale[0])])
    value = fit.value[:16] / scale
    doubt = np.zeros((16, 16))
    doubt[FORCE, FORCE] = along @ matrix[1] @ along.T
    doubt[TURN, TURN] = gyro_scale[1]
    covariance = fit.covariance[:16, :16] / np.outer(scale, scale) + doubt * np.outer(value, value)
    return Pushes(value, covariance)


def valve_findings(
    fit: ValveFit, pushes: Pushes, mass_kg: float, arms: Array, link_sigma_s: float
) -> Findings:
    """Return thrusts, inertia and timing.

    Args:
        fit: The fit.
        pushes: With the sensors' scales out.
        mass_kg: Of the rig, taken as true.
        arms: (8,) torque over force by the rig, m.
        link_sigma_s: What the IMU's link leaves unknown of both delays alike.
    """
    sigma = np.sqrt(pushes.covariance.diagonal())
    found: dict[str, Found] = {}
    unseen: dict[str, str] = {}
    known = []
    for valve in range(VALVES):
        key, force, turn = f"thrusters.{valve}.thrust_n", float(pushes.value[valve]), VALVES + valve
        use = f"valve {valve} was open for {fit.on_s[valve]:.1f} s in all, {fit.openings[valve]} times"
        if force > 0.0 and sigma[valve] < WELL_KNOWN * force:
            known.append(valve)
            found[key] = Found(force * mass_kg, float(sigma[valve]) * mass_kg, "N", use)
            found[f"thrust_over_mass.{valve}"] = Found(force, float(sigma[valve]), "m/s^2")
        else:
            unseen[key] = f"{use}: not enough"
        if sigma[turn] < WELL_KNOWN * abs(float(pushes.value[turn])):
            found[f"torque_over_inertia.{valve}"] = Found(
                float(pushes.value[turn]), float(sigma[turn]), "rad/s^2"
            )
        else:
            unseen[f"torque_over_inertia.{valve}"] = f"{use}: not enough"
    turning = [valve for valve in known if f"torque_over_inertia.{valve}" in found and arms[valve] != 0.0]
    if turning:
        found["inertia_kg_m2"] = _inertia(pushes, mass_kg, arms, turning)
    else:
        unseen["inertia_kg_m2"] = "no valve is known well enough both to push and to turn"
    return Findings(found, unseen) + _timing(fit, link_sigma_s)


def _inertia(pushes: Pushes, mass_kg: float, arms: Array, valves: list[int]) -> Found:
    """Generalised mean of force x lever / turn over the valves."""
    force, turn = pushes.value[valves], pushes.value[VALVES + np.array(valves)]
    each = mass_kg * force * arms[valves] / turn
    slope = np.zeros((len(valves), 16))
    rows = np.arange(len(valves))
    slope[rows, valves], slope[rows, VALVES + np.array(valves)] = each / force, -each / turn
    covariance = slope @ pushes.covariance @ slope.T
    weight = np.linalg.solve(covariance, np.ones(len(valves)))
    value = float(weight @ each / weight.sum())
    sigma = math.sqrt(1.0 / float(weight.sum()))
    remark = "with the mass and the levers of the rig"
    off = (each - value) / np.sqrt(covariance.diagonal())
    if len(valves) > 1 and float((off**2).mean()) > UNEVEN_LEVERS:
        worst = valves[int(np.abs(off).argmax())]
        remark += f"; the valves do not agree on it: valve {worst} turns as if its lever were another"
    return Found(value, sigma, "kg m^2", remark)


def _timing(fit: ValveFit, link_sigma_s: float) -> Findings:
    found: dict[str, Found] = {}
    unseen: dict[str, str] = {}
    sigma = fit.sigma
    sigma[[OPEN, CLOSE]] = np.hypot(sigma[[OPEN, CLOSE]], link_sigma_s)
    rows = (
        ("valves.open_delay_s", OPEN, min(DELAY_KNOWN_S, LEARNED * DELAY_SIGMA_S), "s"),
        ("valves.close_delay_s", CLOSE, min(DELAY_KNOWN_S, LEARNED * DELAY_SIGMA_S), "s"),
        ("valves.rise_s", RISE, min(RISE_KNOWN_S, LEARNED * RISE_SIGMA_S), "s"),
        ("valves.sag", SAG, LEARNED * SAG_SIGMA, "1"),
    )
    for key, place, limit, unit in rows:
        value = float(fit.value[place])
        if value < 0.0:
            unseen[key] = (
                f"comes out at {value:.2g} {unit}: the stamps of IMU and commands are not of one clock"
            )
        elif sigma[place] < limit:
            found[key] = Found(value, float(sigma[place]), unit)
        else:
            unseen[key] = f"the flight tells it to {sigma[place]:.2g} {unit} only"
    jitter, key = fit.spreads.jitter_s, "valves.open_delay_sd_s"
    if fit.jitter_seen > FEWEST_OPENINGS:
        found[key] = Found(jitter, jitter / math.sqrt(2.0 * fit.jitter_seen), "s")
    else:
        unseen[key] = f"{fit.openings.sum()} openings of such noise do not tell their scatter"
    return Findings(found, unseen)


def drag_findings(fit: ValveFit, mass_kg: float, inertia_kg_m2: float) -> Findings:
    """Return drag where it is seen; else below what it must be."""
    found: dict[str, Found] = {}
    unseen: dict[str, str] = {}
    rows = (("drag_n_s_m", DRAG, mass_kg, "N s/m"), ("drag_nm_s", TURN_DRAG, inertia_kg_m2, "N m s"))
    for key, place, size, unit in rows:
        value, sigma = float(fit.value[place]) * size, float(fit.sigma[place]) * size
        if value > SEEN_SIGMAS * sigma:
            found[key] = Found(value, sigma, unit)
        else:
            most = max(0.0, value) + SEEN_SIGMAS * sigma
            unseen[key] = f"too small to be seen: it is below {most:.2g} {unit}"
    return Findings(found, unseen)


def noise_findings(fit: ValveFit, flight: RecordedFlight, model: ValveModel) -> Findings:
    """Return the noise of a poll of each sensor before rounding."""
    found: dict[str, Found] = {}
    unseen: dict[str, str] = {}
    filtered = "noise behind the sensor's low-pass is not told from the vehicle's motion"
    reading, polls = fit.reading, flight.windows.polls
    if model.gyro_lag_s > 0.0:
        unseen["imu.gyro_noise_rad_s"] = filtered
    elif math.isnan(reading.noise_rad_s):
        unseen["imu.gyro_noise_rad_s"] = "the gyro scatters as no noise that is rounded does"
    else:
        found["imu.gyro_noise_rad_s"] = Found(reading.noise_rad_s, reading.noise_sigma_rad_s, "rad/s")
    # each of a chip's two channels is rounded by itself
    variance = polls * fit.spreads.force_m_s2**2 - TILT_SCALE_M_S2**2 / 6.0
    if model.acc_lag_s > 0.0:
        unseen["imu.acc_noise_m_s2"] = filtered
    elif not variance > 0.0:
        unseen["imu.acc_noise_m_s2"] = "the accelerometers scatter less than rounding alone does"
    else:
        noise = math.sqrt(variance)
        sigma = polls * fit.spreads.force_m_s2**2 / noise / math.sqrt(2.0 * 2.0 * fit.packets)
        found["imu.acc_noise_m_s2"] = Found(noise, sigma, "m/s^2")
    return Findings(found, unseen)
