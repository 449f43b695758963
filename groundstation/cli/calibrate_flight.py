"""Calibration from flights: everything at once by the smoother, and the map of the table.

Mounted by `groundstation calibrate`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from calibration.imu.result import CalibrationResult, Quantity, provenance_of
from groundstation.cli.errors import UsageError
from groundstation.cli.fusion import estimate
from groundstation.cli.fusion_folder import FusionFolder, read_folder, write_atomically
from groundstation.cli.table_map_file import map_lines
from groundstation.fusion import error_state as es
from groundstation.fusion.estimator import FixAccount
from groundstation.fusion.map_learning import learn, on_grid
from groundstation.fusion.offline import OfflineSmoother
from groundstation.fusion.table_map import levelling_m

GRID_STEP_M = 0.05
BUMP_WIDTH_M = 0.10
WAVINESS_M_S2 = 2.2e-4
"""RMS of the departure from the mean slope that is expected of a levelled table, per axis."""
LEFT_TO_FILTER_M_S2 = 5e-5
WIDE_GATE = 60.0
"""While a map or a scale is still unknown, good fixes look worse than they are."""
CONSTANTS = {
    "gyro_bias": (es.GYRO_BIAS, "rad/s"),
    "acc_bias_x": (es.ACC_BIAS_X, "m/s^2"),
    "acc_bias_y": (es.ACC_BIAS_Y, "m/s^2"),
    "gyro_scale": (es.GYRO_SCALE, "1"),
    "acc_scale_x": (es.ACC_MATRIX, "1"),
    "acc_cross_xy": (es.ACC_MATRIX + 1, "1"),
    "acc_cross_yx": (es.ACC_MATRIX + 2, "1"),
    "acc_scale_y": (es.ACC_MATRIX + 3, "1"),
    "lever_x": (es.LEVER_X, "m"),
    "lever_y": (es.LEVER_Y, "m"),
    "gyro_temperature_slope": (es.GYRO_TEMPCO, "rad/s/C"),
    "acc_x_temperature_slope": (es.ACC_TEMPCO_X, "m/s^2/C"),
    "acc_y_temperature_slope": (es.ACC_TEMPCO_Y, "m/s^2/C"),
    "slope_x": (es.SLOPE_X, "m/s^2"),
    "slope_y": (es.SLOPE_Y, "m/s^2"),
    "camera_delay": (es.FIX_DELAY, "s"),
}
"""Biases are those at the end of the recording and at its first temperature."""

OutOption = Annotated[Path, typer.Option(help="File to write.")]
PlotOption = Annotated[Path | None, typer.Option(help="PNG to draw as well.")]


def joint(
    folder: Annotated[Path, typer.Argument(help="Folder with imu.csv, stars.csv and meta.json.")],
    out: OutOption,
    plot: PlotOption = None,
) -> None:
    """Re-estimate every constant of sensors, mounting, camera delay and slope from one recorded flight.

    A quantity that the flight did not excite keeps a wide sigma: turn for scale and lever arm, push along
    both axes for the accelerometers' scales, warm up for the temperature slopes.

    Example: groundstation calibrate joint samples/fusion/spin --out joint.toml --plot residuals.png
    """
    data = read_folder(folder)
    noise = replace(
        data.noise,
        gyro_scale_sigma=0.05,
        acc_scale_sigma=0.05,
        imu_offset_sigma_m=0.02,
        tempco_sigma_ratio=1.0,
        fix_delay_sigma_s=0.02,
        gate_nis=WIDE_GATE,
    )
    smoother = OfflineSmoother(noise)
    _, accounts = estimate(data, smoother)
    nodes = smoother.finish().nodes
    if not nodes:
        raise UsageError(f"{folder}: no two star fixes agreed, so nothing can be calibrated.")
    last = nodes[-1]
    quantities = {
        name: Quantity(float(last.x[k]), math.sqrt(max(0.0, float(last.P[k, k]))), unit)
        for name, (k, unit) in CONSTANTS.items()
    }
    used = [account for account in accounts if account.reason == "used"]
    residual = _residuals(data, smoother, used)
    spread = np.sqrt((residual[:, 1:] ** 2).mean(axis=0))
    result = CalibrationResult(
        "Constants of one mock-up, jointly from a flight",
        provenance_of(folder, datetime.now(UTC)),
        quantities,
        {
            "x": Quantity(float(spread[0]), math.nan, "m"),
            "y": Quantity(float(spread[1]), math.nan, "m"),
            "heading": Quantity(float(spread[2]), math.nan, "rad"),
        },
        {"fixes": len(used), "fixes_refused": len(accounts) - len(used)},
    )
    write_atomically({out: [result.to_toml()]})
    for name, quantity in quantities.items():
        print(f"{name} = {quantity.value:.6g} ± {quantity.std:.2g} {quantity.unit}")
    if plot is not None:
        from groundstation.cli.calibration_plots import plot_residuals

        plot_residuals(residual, np.array([account.nis for account in used]), plot)


def _residuals(data: FusionFolder, smoother: OfflineSmoother, used: list[FixAccount]) -> np.ndarray:
    """Return (m, 4) exposure s, and fix less smoothed x, y, heading."""
    states = [state for state in smoother.states() if state is not None]
    t = np.array([state.t_ns for state in states]) * 1e-9
    pose = np.array([state[1:4] for state in states])
    wanted = {round(account.t_exposure_ns / 1e3) for account in used}
    rows = []
    for exposure, _, x, y, heading in data.stars.tolist():
        if math.isfinite(exposure) and round(exposure * 1e6) in wanted:
            at = [float(np.interp(exposure, t, column)) for column in pose.T]
            rows.append([exposure, x - at[0], y - at[1], math.remainder(heading - at[2], math.tau)])
    return np.array(rows).reshape(-1, 4)


def table_map(
    folders: Annotated[list[Path], typer.Argument(help="Recordings over the same table; laps are best.")],
    out: OutOption,
    plot: PlotOption = None,
    legs: Annotated[
        str | None, typer.Option(help='Where the legs stand, m: "A=-1,-0.8 B=1,-0.8 C=0,0.9".')
    ] = None,
) -> None:
    """Learn the table's slope from laps: a map for filter and controller, and advice for levelling.

    Example: groundstation calibrate table-map lap1/ lap2/ lap3/ --out table.csv --plot table.png
    """
    places = _legs(legs)
    traces = []
    for folder in folders:
        data = read_folder(folder)
        noise = replace(data.noise, waviness_sigma_m_s2=LEFT_TO_FILTER_M_S2, gate_nis=WIDE_GATE)
        smoother = OfflineSmoother(noise)
        estimate(data, smoother)
        smoother.finish()
        traces.append(smoother.trace)
    try:
        learned = learn(traces, WAVINESS_M_S2, BUMP_WIDTH_M)
    except ValueError as error:
        raise UsageError(f"{folders[0]}: {error}.") from None
    grid = on_grid(learned, GRID_STEP_M)
    tilt = (float(learned.tilt_m_s2[0]) / 9.80665, float(learned.tilt_m_s2[1]) / 9.80665)
    quantities = {
        f"tilt_{axis}": Quantity(tilt[k], float(learned.tilt_std_m_s2[k]) / 9.80665, "rad")
        for k, axis in enumerate("xy")
    }
    advice = (
        {name: Quantity(rise, math.nan, "m") for name, rise in levelling_m(tilt, places).items()}
        if places
        else {}
    )
    provenance = provenance_of(folders[0], datetime.now(UTC))
    result = CalibrationResult(
        "Mean tilt of the table (pull over g); the map is in the CSV of the same name",
        provenance,
        quantities | {f"raise_leg_{name}": rise for name, rise in advice.items()},
        {},
        {"recordings": [folder.name for folder in folders], "explained_share_of_nis": learned.explained},
    )
    write_atomically({out: map_lines(grid), out.with_suffix(".toml"): [result.to_toml()]})
    print(
        f"tilt {1e3 * tilt[0]:.3f}, {1e3 * tilt[1]:.3f} mrad; "
        f"the map explains {100 * learned.explained:.0f} % of the innovations' squares"
    )
    for name, rise in advice.items():
        print(f"raise leg {name} by {1e3 * rise.value:.2f} mm" if rise.value > 5e-5 else f"leg {name} stays")
    if plot is not None:
        from groundstation.cli.calibration_plots import plot_map

        plot_map(grid, learned.path_m, plot)


def _legs(text: str | None) -> dict[str, tuple[float, float]]:
    """Read "A=x,y B=x,y"."""
    places: dict[str, tuple[float, float]] = {}
    for item in (text or "").split():
        name, _, place = item.partition("=")
        try:
            x, y = (float(value) for value in place.split(","))
        except ValueError:
            raise UsageError(f'--legs must read like "A=-1,-0.8 B=1,-0.8", found {item!r}.') from None
        places[name] = (x, y)
    return places
