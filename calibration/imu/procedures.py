"""The calibrations of the IMU from rests, turns and stretches of flight: a flight in, an outcome out."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from calibration.imu import figures
from calibration.imu.allan import allan_deviation, bridge_holes
from calibration.imu.gyro_scale import gyro_scale
from calibration.imu.temperature import temperature_slope
from calibration.imu.zero_offset import Disturbance, ZeroOffset, zero_offset
from calibration.outcome import CalibrationRefusedError, Note, Outcome
from calibration.result import Quantity, quantity_lines
from groundstation.fusion.flight_data import Array, FlightData
from groundstation.fusion.stretch import fit_stretch

UNITS = {"omega": "rad/s", "ax": "m/s^2", "ay": "m/s^2"}
LEAST_REST_S = 1.0
WILD_RATE_RAD_S = math.radians(400.0)
SPIKE_SIGMAS = 12.0


def offsets_at_rest(data: FlightData) -> Outcome:
    """Take the mean of the rest at the start, after a test that it was one.

    Raises:
        NotARest: It was none.
    """
    found = _rest(data)
    cut = [words_of(each) for each in found.disturbances]
    quantities = {
        f"{name}_offset": Quantity(float(found.mean[k]), float(found.mean_sigma[k]), unit)
        for k, (name, unit) in enumerate(UNITS.items())
    }
    return Outcome(
        title="Zero offsets at rest",
        summary="\n".join([*quantity_lines(quantities), *(f"  cut out: {line}" for line in cut)]),
        quantities=quantities,
        residual={
            f"{name}_packet_sigma": Quantity(float(found.packet_sigma[k]), math.nan, unit)
            for k, (name, unit) in enumerate(UNITS.items())
        },
        notes={
            "temperature_C": found.temperature_c,
            "packets": found.packets,
            "duration_s": found.duration_s,
            "cut": cut,
        },
        draw=partial(figures.draw_rest, data.at_rest(), found),
    )


def offsets_of_stretch(data: FlightData, start_s: float, end_s: float) -> Outcome:
    """Fit the constant offsets (mu, nu) of the accelerometers over a stretch of flight, as published.

    Raises:
        CalibrationRefusedError: There is too little in the stretch.
    """
    noise = data.noise
    lever = (noise.imu_offset_x_m, noise.imu_offset_y_m)
    sigma = (noise.star_sigma_xy_m, noise.star_sigma_heading_rad)
    try:
        fit, refused = fit_stretch(data.imu, data.stars, start_s, end_s, _null(data), lever, sigma)
    except ValueError as error:
        raise CalibrationRefusedError(f"from {start_s:g} to {end_s:g} s: {error}") from error
    found_sigma = np.sqrt(np.diag(fit.covariance))
    return _outcome(
        "Zero offsets (mu, nu) by least squares over a stretch of flight",
        {
            "mu": Quantity(fit.mu_m_s2, float(found_sigma[0]), "m/s^2"),
            "nu": Quantity(fit.nu_m_s2, float(found_sigma[1]), "m/s^2"),
        },
        {"position": Quantity(fit.residual_rms_m, math.nan, "m")},
        {"start_s": start_s, "end_s": end_s, "fixes": fit.fixes, "fixes_refused": refused},
        partial(figures.draw_offset_fit, fit.residual_m),
    )


def temperature_slopes(data: FlightData) -> Outcome:
    """Find how offsets move with temperature, from a long rest that warms up.

    Raises:
        CalibrationRefusedError: It is too short, or the temperature changed too little.
    """
    rest = data.at_rest()
    found = temperature_slope(rest[:, 0], rest[:, 1:4], rest[:, 4])
    units = list(enumerate(UNITS.items()))
    slopes = {
        f"{name}_slope": Quantity(float(found.slope[k]), float(found.slope_sigma[k]), f"{unit}/C")
        for k, (name, unit) in units
    }
    values = {
        f"{name}_at_reference": Quantity(float(found.at_reference[k]), math.nan, unit)
        for k, (name, unit) in units
    }
    return _outcome(
        "Temperature slopes of the zero offsets",
        slopes | values,
        {name: Quantity(float(found.residual_rms[k]), math.nan, unit) for k, (name, unit) in units},
        {"reference_C": found.reference_c, "span_C": found.span_c},
        partial(figures.draw_temperature, found),
    )


def gyro_scale_by_turns(data: FlightData) -> Outcome:
    """Find scale and null of the gyro by full turns against the stars.

    Raises:
        CalibrationRefusedError: There are too few fixes, or no full turn.
    """
    imu, stars = data.imu, data.stars[np.argsort(data.stars[:, 0], kind="stable")]
    good = np.isfinite(imu[:, 1]) & (np.abs(imu[:, 1]) < WILD_RATE_RAD_S)
    t, rate = imu[good, 0], imu[good, 1]
    span = np.diff(t, prepend=t[0] - data.noise.packet_period_s)
    found = gyro_scale(t, span, _without_spikes(rate), stars[:, 0], stars[:, 4], _null(data))
    return _outcome(
        "Gyro scale and null by turns against the stars",
        {
            "scale": Quantity(found.scale, found.scale_sigma, "1"),
            "null": Quantity(found.null_rad_s, found.null_sigma_rad_s, "rad/s"),
        },
        {"heading": Quantity(found.residual_rms_rad, math.nan, "rad")},
        {"turned_deg": math.degrees(found.turned_rad), "fixes": found.used, "fixes_refused": found.refused},
        partial(figures.draw_scale, found),
    )


def noise_at_rest(data: FlightData) -> Outcome:
    """Find white noise and bias instability from the Allan deviation of a long rest.

    Raises:
        CalibrationRefusedError: It is too short.
    """
    rest, found_rest = data.at_rest(), _rest(data)
    wild = {d.start_s for d in found_rest.disturbances if d.kind == "wild packet"}
    rest = rest[[t not in wild for t in rest[:, 0].tolist()]]
    period = data.noise.packet_period_s
    even = bridge_holes(rest[:, 0], rest[:, 1:4], period)
    curves = {name: allan_deviation(even[:, k], period) for k, name in enumerate(UNITS)}
    quantities = {}
    for name, curve in curves.items():
        relative = float(curve.sigma[0] / curve.deviation[0])
        quantities[f"{name}_random_walk"] = Quantity(
            curve.random_walk, curve.random_walk * relative, f"{UNITS[name]} sqrt(s)"
        )
        quantities[f"{name}_bias_instability"] = Quantity(curve.bias_instability, math.nan, UNITS[name])
    return _outcome(
        "White noise and bias instability (Allan deviation)",
        quantities,
        {},
        {f"{name}_instability_is_upper_limit": not curve.is_floor_seen for name, curve in curves.items()},
        partial(figures.draw_allan, curves, UNITS),
    )


def words_of(cut: Disturbance) -> str:
    """Return what was cut out of a rest, in words."""
    span = f"from {cut.start_s:.2f} to {cut.end_s:.2f} s"
    return f"{cut.kind} in {cut.channel} {span}, {cut.size:.2g} {UNITS[cut.channel]}"


def _outcome(
    title: str,
    quantities: dict[str, Quantity],
    residual: dict[str, Quantity],
    notes: dict[str, Note],
    draw: figures.Draw,
) -> Outcome:
    return Outcome(title, "\n".join(quantity_lines(quantities)), quantities, residual, notes, draw)


def _rest(data: FlightData) -> ZeroOffset:
    rest = data.at_rest()
    return zero_offset(rest[:, 0], rest[:, 1:4], rest[:, 4])


def _null(data: FlightData) -> float:
    """Return the gyro's null by the rest at the start, 0 without one."""
    return float(_rest(data).mean[0]) if data.run_start_s > LEAST_REST_S else 0.0


def _without_spikes(values: Array) -> Array:
    """Return readings with single packets that jump away and back replaced by the median of five."""
    padded = np.pad(values, 2, mode="edge")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    spread = 1.4826 * float(np.median(np.abs(values - middle))) + 1e-12
    return np.where(np.abs(values - middle) > SPIKE_SIGMAS * spread, middle, values)
