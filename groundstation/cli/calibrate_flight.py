"""Calibration from a flight: every constant at once, by the smoother.

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

from calibration.result import CalibrationResult, Quantity, provenance_of
from groundstation.cli.errors import UsageError
from groundstation.cli.flight_data import read_flight
from groundstation.cli.fusion import estimate
from groundstation.cli.fusion_folder import FusionFolder, write_atomically
from groundstation.cli.table_map import map_of_sources
from groundstation.cli.table_map_flights import read_source
from groundstation.files.errors import FileError
from groundstation.fusion.constants import CONSTANTS
from groundstation.fusion.estimator import FixAccount
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.offline import OfflineSmoother

WIDE_GATE = 60.0
"""While a scale is still unknown, good fixes look worse than they are."""
OutOption = Annotated[Path, typer.Option(help="File to write.")]
PlotOption = Annotated[Path | None, typer.Option(help="PNG to draw as well.")]


def widened(noise: NoiseModel) -> NoiseModel:
    """Return a model that believes no earlier calibration of the constants."""
    return replace(
        noise,
        gyro_scale_sigma=0.05,
        acc_scale_sigma=0.05,
        imu_offset_sigma_m=0.02,
        tempco_sigma_ratio=1.0,
        fix_delay_sigma_s=0.02,
        calibrated=(),
        gate_nis=WIDE_GATE,
    )


def constants(smoother: OfflineSmoother) -> dict[str, Quantity]:
    """Return every constant with its sigma after a finished recording; empty if no pose was ever found."""
    nodes = smoother.finish().nodes
    if not nodes:
        return {}
    last = nodes[-1]
    return {
        name: Quantity(float(last.x[k]), math.sqrt(max(0.0, float(last.P[k, k]))), unit)
        for name, (k, unit) in CONSTANTS.items()
    }


def joint(
    folder: Annotated[
        Path, typer.Argument(help="Recording (.mcap), or folder with imu.csv, stars.csv and meta.json.")
    ],
    out: OutOption,
    plot: PlotOption = None,
    table_map: Annotated[
        Path | None, typer.Option(help="TOML to write the slope's map to, with its sigmas.")
    ] = None,
    vehicle: Annotated[str | None, typer.Option(help="Of a recording with several vehicles.")] = None,
) -> None:
    """Re-estimate every constant of sensors, mounting, camera delay and slope from one recorded flight.

    A quantity that the flight did not excite keeps a wide sigma: turn for scale and lever arm, push along
    both axes for the accelerometers' scales, warm up for the temperature slopes. Turns give the lever arm of
    the IMU. With --table-map the slope by place comes from the same flight, fitted together with its biases,
    scales, lever arm and delay (`calibrate table-map` takes many flights and draws it).

    Example: groundstation calibrate joint samples/fusion/spin --out joint.toml --plot residuals.png
    """
    data = read_flight(folder, vehicle)
    made = None if table_map is None else map_of_sources([read_source(folder, None, vehicle)])[1]
    noise = widened(data.noise)
    smoother = OfflineSmoother(noise)
    _, accounts = estimate(data, smoother)
    quantities = constants(smoother)
    if not quantities:
        raise UsageError(f"{folder}: no two star fixes agreed, so nothing can be calibrated.")
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
    if made is not None and table_map is not None:
        try:
            made.save(table_map)
        except FileError as error:
            raise UsageError(str(error)) from None
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
