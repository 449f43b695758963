"""`groundstation calibrate`: from recordings to calibration numbers with provenance."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from calibration.imu.zero_offset import NotARest, ZeroOffset, zero_offset
from calibration.result import CalibrationResult, Quantity, provenance_of
from groundstation.cli import calibrate_flight, calibrate_guided, calibrate_tilt, table_map
from groundstation.cli.errors import UsageError
from groundstation.cli.flight_data import read_flight
from groundstation.cli.fusion_folder import Array, FusionFolder, write_atomically

app = typer.Typer(no_args_is_help=True, add_completion=False, rich_markup_mode=None)

FolderArgument = Annotated[
    Path, typer.Argument(help="Recording (.mcap), or folder with imu.csv, meta.json (and stars.csv).")
]
OutOption = Annotated[Path, typer.Option(help="TOML to write.")]
PlotOption = Annotated[Path | None, typer.Option(help="PNG to draw as well.")]
VehicleOption = Annotated[str | None, typer.Option(help="Of a recording with several vehicles.")]
app.command("joint")(calibrate_flight.joint)
app.command("imu")(calibrate_guided.imu)
app.command("tilt")(calibrate_tilt.tilt)
app.command("table-map")(table_map.table_map)
UNITS = {"omega": "rad/s", "ax": "m/s^2", "ay": "m/s^2"}


@app.callback()
def _root() -> None:
    """From recordings to calibration numbers.

    Example: groundstation calibrate zero-offset FOLDER --out rest.toml
    """


@app.command("zero-offset")
def zero_offset_command(
    folder: FolderArgument, out: OutOption, plot: PlotOption = None, vehicle: VehicleOption = None
) -> None:
    """Mean of the rest at the start, after a test that it was one.

    Example: groundstation calibrate zero-offset samples/fusion/station --out rest.toml
    """
    data = read_flight(folder, vehicle, with_stars=False)
    found = _rest(folder, data)
    quantities = {
        f"{name}_offset": Quantity(float(found.mean[k]), float(found.std[k]), UNITS[name])
        for k, name in enumerate(UNITS)
    }
    residual = {
        f"{name}_packet_sigma": Quantity(float(found.packet_sigma[k]), math.nan, UNITS[name])
        for k, name in enumerate(UNITS)
    }
    cut = [
        f"{d.kind} in {d.channel} from {d.start_s:.2f} to {d.end_s:.2f} s, {d.size:.2g} {UNITS[d.channel]}"
        for d in found.disturbances
    ]
    notes = {
        "temperature_C": found.temperature_c,
        "packets": found.packets,
        "duration_s": found.duration_s,
        "cut": cut,
    }
    _write(out, "Zero offsets at rest", folder, quantities, residual, notes)
    for line in cut:
        print(f"  cut out: {line}")
    if plot is not None:
        from groundstation.cli.calibration_plots import plot_rest

        plot_rest(at_rest(data), found, plot)


@app.command("zero-offset-fit")
def zero_offset_fit(
    folder: FolderArgument,
    start_s: Annotated[float, typer.Option(help="Start of the stretch of flight.")],
    end_s: Annotated[float, typer.Option(help="End of the stretch of flight.")],
    out: OutOption,
    plot: PlotOption = None,
    vehicle: VehicleOption = None,
) -> None:
    """Least squares for the accelerometers' constant offsets (mu, nu) over a stretch, as published.

    Example: groundstation calibrate zero-offset-fit FOLDER --start-s 10 --end-s 30 --out fit.toml
    """
    from groundstation.fusion.stretch import fit_stretch

    if not end_s > start_s:
        raise UsageError(f"--end-s must be after --start-s, found {start_s:g} and {end_s:g}.")
    data = read_flight(folder, vehicle)
    noise = data.noise
    null = float(_rest(folder, data).mean[0]) if data.run_start_s > 1.0 else 0.0
    lever = (noise.imu_offset_x_m, noise.imu_offset_y_m)
    sigma = (noise.star_sigma_xy_m, noise.star_sigma_heading_rad)
    try:
        fit, refused = fit_stretch(data.imu, data.stars, start_s, end_s, null, lever, sigma)
    except ValueError as error:
        raise UsageError(f"{folder} from {start_s:g} to {end_s:g} s: {error}.") from None
    std = np.sqrt(np.diag(fit.cov))
    _write(
        out, "Zero offsets (mu, nu) by least squares over a stretch of flight", folder,
        {
            "mu": Quantity(fit.mu_m_s2, float(std[0]), "m/s^2"),
            "nu": Quantity(fit.nu_m_s2, float(std[1]), "m/s^2"),
        },
        {"position": Quantity(fit.residual_rms_m, math.nan, "m")},
        {"start_s": start_s, "end_s": end_s, "fixes": fit.fixes, "fixes_refused": refused},
    )  # fmt: skip
    if plot is not None:
        from groundstation.cli.calibration_plots import plot_offset_fit

        plot_offset_fit(fit.residual_m, plot)


@app.command()
def temperature(
    folder: FolderArgument, out: OutOption, plot: PlotOption = None, vehicle: VehicleOption = None
) -> None:
    """Temperature slopes of the gyro's null and the tilt offsets, from a long rest that warms up.

    Example: groundstation calibrate temperature warm_up/ --out temperature.toml
    """
    from calibration.imu.temperature import temperature_slope

    rest = at_rest(read_flight(folder, vehicle, with_stars=False))
    try:
        found = temperature_slope(rest[:, 0], rest[:, 1:4], rest[:, 4])
    except (ValueError, IndexError) as error:
        raise UsageError(f"{folder}: {error}.") from None
    quantities = {
        f"{name}_slope": Quantity(float(found.slope[k]), float(found.slope_std[k]), f"{UNITS[name]}/C")
        for k, name in enumerate(UNITS)
    }
    quantities |= {
        f"{name}_at_reference": Quantity(float(found.at_reference[k]), math.nan, UNITS[name])
        for k, name in enumerate(UNITS)
    }
    residual = {
        name: Quantity(float(found.residual_rms[k]), math.nan, UNITS[name]) for k, name in enumerate(UNITS)
    }
    notes = {"reference_C": found.reference_c, "span_C": found.span_c}
    _write(out, "Temperature slopes of the zero offsets", folder, quantities, residual, notes)
    if plot is not None:
        from groundstation.cli.calibration_plots import plot_temperature

        plot_temperature(found, plot)


@app.command("gyro-scale")
def gyro_scale_command(
    folder: FolderArgument, out: OutOption, plot: PlotOption = None, vehicle: VehicleOption = None
) -> None:
    """Gyro scale by full turns against the stars.

    Example: groundstation calibrate gyro-scale samples/fusion/spin --out scale.toml
    """
    from calibration.imu.gyro_scale import gyro_scale

    data = read_flight(folder, vehicle)
    imu, stars = data.imu, data.stars[np.argsort(data.stars[:, 0], kind="stable")]
    null = float(_rest(folder, data).mean[0]) if data.run_start_s > 1.0 else 0.0
    good = np.isfinite(imu[:, 1]) & (np.abs(imu[:, 1]) < math.radians(400.0))
    t, omega = imu[good, 0], imu[good, 1]
    span = np.diff(t, prepend=t[0] - data.noise.packet_period_s)
    try:
        found = gyro_scale(t, span, _without_spikes(omega), stars[:, 0], stars[:, 4], null)
    except ValueError as error:
        raise UsageError(f"{folder}: {error}.") from None
    _write(
        out, "Gyro scale and null by turns against the stars", folder,
        {
            "scale": Quantity(found.scale, found.scale_std, "1"),
            "null": Quantity(found.null_rad_s, found.null_std_rad_s, "rad/s"),
        },
        {"heading": Quantity(found.residual_rms_rad, math.nan, "rad")},
        {"turned_deg": math.degrees(found.turned_rad), "fixes": found.used, "fixes_refused": found.refused},
    )  # fmt: skip
    if plot is not None:
        from groundstation.cli.calibration_plots import plot_scale

        plot_scale(found, plot)


@app.command()
def allan(
    folder: FolderArgument, out: OutOption, plot: PlotOption = None, vehicle: VehicleOption = None
) -> None:
    """Allan deviation: white noise, bias instability, from a long rest.

    Example: groundstation calibrate allan night_at_rest/ --out noise.toml --plot noise.png
    """
    from calibration.imu.allan import allan_deviation, bridge_holes

    data = read_flight(folder, vehicle, with_stars=False)
    rest, found_rest = at_rest(data), _rest(folder, data)
    wild = {d.start_s for d in found_rest.disturbances if d.kind == "wild packet"}
    rest = rest[[t not in wild for t in rest[:, 0].tolist()]]
    period = data.noise.packet_period_s
    even = bridge_holes(rest[:, 0], rest[:, 1:4], period)
    try:
        curves = {name: allan_deviation(even[:, k], period) for k, name in enumerate(UNITS)}
    except ValueError as error:
        raise UsageError(f"{folder}: {error}.") from None
    quantities = {}
    for name, curve in curves.items():
        relative = float(curve.std[0] / curve.deviation[0])
        quantities[f"{name}_random_walk"] = Quantity(
            curve.random_walk, curve.random_walk * relative, f"{UNITS[name]} sqrt(s)"
        )
        quantities[f"{name}_bias_instability"] = Quantity(curve.bias_instability, math.nan, UNITS[name])
    notes: dict[str, Any] = {
        f"{name}_instability_is_upper_limit": not curve.is_floor_seen for name, curve in curves.items()
    }
    _write(out, "White noise and bias instability (Allan deviation)", folder, quantities, {}, notes)
    if plot is not None:
        from groundstation.cli.calibration_plots import plot_allan

        plot_allan(curves, UNITS, plot)


def at_rest(data: FusionFolder) -> Array:
    """Return the packets of the rest at the start."""
    return data.imu[data.imu[:, 0] <= data.run_start_s]


def _rest(folder: Path, data: FusionFolder) -> ZeroOffset:
    rest = at_rest(data)
    try:
        return zero_offset(rest[:, 0], rest[:, 1:4], rest[:, 4])
    except NotARest as error:
        raise UsageError(f"{folder}: {error}.") from None


def _without_spikes(values: Array) -> Array:
    """Return readings with single packets that jump away and back replaced by the median of five."""
    padded = np.pad(values, 2, mode="edge")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    spread = 1.4826 * float(np.median(np.abs(values - middle))) + 1e-12
    return np.where(np.abs(values - middle) > 12.0 * spread, middle, values)


def _write(
    out: Path,
    title: str,
    folder: Path,
    quantities: dict[str, Quantity],
    residual: dict[str, Quantity],
    notes: dict[str, Any],
) -> None:
    result = CalibrationResult(title, provenance_of(folder, datetime.now(UTC)), quantities, residual, notes)
    write_atomically({out: [result.to_toml()]})
    for name, quantity in quantities.items():
        spread = "" if math.isnan(quantity.std) else f" ± {quantity.std:.2g}"
        print(f"{name} = {quantity.value:.6g}{spread} {quantity.unit}")
