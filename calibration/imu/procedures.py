"""The calibrations of the IMU from rests, turns and stretches of flight: a flight in, an outcome out."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from calibration.imu import figures
from calibration.imu.channels import UNITS, Alive, alive_channels, complaint_about
from calibration.imu.everyday_units import lines_of
from calibration.imu.gyro_scale import gyro_scale
from calibration.imu.temperature import temperature_slope
from calibration.imu.zero_offset import Disturbance, ZeroOffset, zero_offset
from calibration.outcome import CalibrationRefusedError, Note, Outcome
from calibration.result import Quantity
from groundstation.fusion.flight_data import Array, FlightData
from groundstation.fusion.published_stretch import fit_published_stretch
from groundstation.fusion.stretch import fit_stretch

LEAST_REST_S = 1.0
WILD_RATE_RAD_S = math.radians(400.0)
SPIKE_SIGMAS = 12.0


def offsets_at_rest(data: FlightData) -> Outcome:
    """Take the mean of the rest at the start, after a test that it was one.

    Raises:
        NotARest: It was none.
    """
    found, alive = rest_of(data)
    cut = [words_of(each) for each in found.disturbances]
    quantities = {
        f"{name}_offset": Quantity(float(found.mean[k]), float(found.mean_sigma[k]), UNITS[name])
        for k, name in enumerate(alive.names)
    }
    rest = data.at_rest()
    return Outcome(
        title="Zero offsets at rest",
        summary="\n".join([*lines_of(quantities), *(f"  cut out: {line}" for line in cut)]),
        quantities=quantities,
        residual={
            f"{name}_packet_sigma": Quantity(float(found.packet_sigma[k]), math.nan, UNITS[name])
            for k, name in enumerate(alive.names)
        },
        notes={
            "temperature_C": found.temperature_c,
            "packets": found.packets,
            "duration_s": found.duration_s,
            "cut": cut,
        },
        draw=partial(figures.draw_rest, rest[:, 0], readings_of(rest, alive), found, labels_of(alive)),
        warnings=alive.complaints,
    )


def offsets_of_stretch(data: FlightData, start_s: float, end_s: float) -> Outcome:
    """Fit the constant offsets (mu, nu) of the accelerometers over a stretch of flight, wrong fixes left out.

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


def offsets_as_published(data: FlightData, start_s: float, end_s: float) -> Outcome:
    """Fit the constant offsets of the accelerometers as published, where they are called alpha and beta.

    What is given is to be taken from the readings: the zeros of the rest, and what the fit finds beyond them.

    Raises:
        CalibrationRefusedError: There is too little in the stretch.
    """
    try:
        found = fit_published_stretch(data, start_s, end_s)
    except ValueError as error:
        raise CalibrationRefusedError(f"from {start_s:g} to {end_s:g} s: {error}") from error
    fit = found.fit
    return _outcome(
        "Zero offsets (alpha, beta) by the published least squares over a stretch of flight",
        {
            "mu": Quantity(found.zeros[1] + fit.alpha_m_s2, math.nan, "m/s^2"),
            "nu": Quantity(found.zeros[2] + fit.beta_m_s2, math.nan, "m/s^2"),
        },
        {
            "position": Quantity(fit.residual_rms_m, math.nan, "m"),
            "position_before": Quantity(fit.before_rms_m, math.nan, "m"),
        },
        {
            "start_s": start_s,
            "end_s": end_s,
            "fixes": len(found.fix_s),
            "alpha_beyond_rest_m_s2": fit.alpha_m_s2,
            "beta_beyond_rest_m_s2": fit.beta_m_s2,
            "alpha_with_printed_sign_m_s2": fit.printed[0],
            "beta_with_printed_sign_m_s2": fit.printed[1],
        },
        partial(figures.draw_published_offsets, found),
    )


def temperature_slopes(data: FlightData) -> Outcome:
    """Find how offsets move with temperature, from a long rest that warms up.

    Raises:
        CalibrationRefusedError: It is too short, or the temperature changed too little.
    """
    rest = data.at_rest()
    alive = _alive(data, rest)
    found = temperature_slope(rest[:, 0], readings_of(rest, alive), rest[:, 4])
    slopes = {
        f"{name}_slope": Quantity(float(found.slope[k]), float(found.slope_sigma[k]), f"{UNITS[name]}/C")
        for k, name in enumerate(alive.names)
    }
    values = {
        f"{name}_at_reference": Quantity(float(found.at_reference[k]), math.nan, UNITS[name])
        for k, name in enumerate(alive.names)
    }
    return _outcome(
        "Temperature slopes of the zero offsets",
        slopes | values,
        {
            name: Quantity(float(found.residual_rms[k]), math.nan, UNITS[name])
            for k, name in enumerate(alive.names)
        },
        {"reference_C": found.reference_c, "span_C": found.span_c},
        partial(figures.draw_temperature, found, labels_of(alive)),
        alive.complaints,
    )


def gyro_scale_by_turns(data: FlightData) -> Outcome:
    """Find scale and null of the gyro by full turns against the stars.

    Raises:
        CalibrationRefusedError: There are too few fixes, no full turn, or headings that do not follow.
    """
    imu, stars = data.imu, data.stars[np.argsort(data.stars[:, 0], kind="stable")]
    complaint = complaint_about(imu[:, 1])
    if complaint is not None:
        raise CalibrationRefusedError(f"omega {complaint}")
    good = np.isfinite(imu[:, 1]) & (np.abs(imu[:, 1]) < WILD_RATE_RAD_S)
    if good.mean() < 0.5:
        raise CalibrationRefusedError(
            f"omega is beyond {math.degrees(WILD_RATE_RAD_S):.0f} deg/s in "
            f"{100 * (1 - good.mean()):.0f} % of the packets: in deg/s? rad/s are expected"
        )
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


def words_of(cut: Disturbance) -> str:
    """Return what was cut out of a rest, in words."""
    span = f"from {cut.start_s:.2f} to {cut.end_s:.2f} s"
    return f"{cut.kind} in {cut.channel} {span}, {cut.size:.2g} {UNITS[cut.channel]}"


def rest_of(data: FlightData) -> tuple[ZeroOffset, Alive]:
    """Judge the rest at the start, and return what its living channels read.

    Raises:
        NotARest: It was none.
        CalibrationRefusedError: No channel is alive.
    """
    rest = data.at_rest()
    alive = _alive(data, rest)
    found = zero_offset(rest[:, 0], readings_of(rest, alive), rest[:, 4], alive.names)
    return found, alive


def readings_of(rest: Array, alive: Alive) -> Array:
    """Return the living channels (n, c) of packets (n, 5)."""
    return rest[:, [1 + k for k in alive.columns]]


def labels_of(alive: Alive) -> list[str]:
    """Return names with units, for figures."""
    return [f"{name}, {UNITS[name]}".replace("^2", "²") for name in alive.names]


def _alive(data: FlightData, rest: Array) -> Alive:
    if not len(rest):
        raise CalibrationRefusedError("there is no packet of a rest at the start")
    return alive_channels(rest[:, 1:4], data.noise)


def _outcome(
    title: str,
    quantities: dict[str, Quantity],
    residual: dict[str, Quantity],
    notes: dict[str, Note],
    draw: figures.Draw,
    warnings: tuple[str, ...] = (),
) -> Outcome:
    return Outcome(title, "\n".join(lines_of(quantities)), quantities, residual, notes, draw, warnings)


def _null(data: FlightData) -> float:
    """Return the gyro's null by the rest at the start, 0 without one."""
    if data.run_start_s <= LEAST_REST_S:
        return 0.0
    rest = data.at_rest()
    return float(zero_offset(rest[:, 0], rest[:, 1:2], rest[:, 4], ("omega",)).mean[0])


def _without_spikes(values: Array) -> Array:
    """Return readings with single packets that jump away and back replaced by the median of five."""
    padded = np.pad(values, 2, mode="edge")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    spread = 1.4826 * float(np.median(np.abs(values - middle))) + 1e-12
    return np.where(np.abs(values - middle) > SPIKE_SIGMAS * spread, middle, values)
