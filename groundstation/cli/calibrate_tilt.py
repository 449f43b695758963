"""`groundstation calibrate tilt`: scale and axes of the accelerometers from rests at several tilts.

Mounted by `groundstation calibrate`.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from calibration.imu.rests import find_rests
from calibration.imu.tilt_axes import Rest, TiltAxes, combination, tilt_axes
from calibration.imu.zero_offset import Disturbance, NotARest, zero_offset
from calibration.result import CalibrationResult, Provenance, Quantity, provenance_of
from groundstation.cli.errors import UsageError
from groundstation.cli.flight_data import read_flight
from groundstation.cli.fusion_folder import Array, FusionFolder, read_table, write_atomically
from groundstation.files.errors import FileError
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.slope_grid import RELEVELLING_SIGMA_M_S2
from groundstation.fusion.table_map import TableMap

TILT_COLUMNS = ("along_x_deg", "along_y_deg")
UNITS = {"omega": "rad/s", "ax": "m/s^2", "ay": "m/s^2"}
LOUDER_THAN_STATED = 5.0
DIFFERENCE, SHEAR = (1.0, 0.0, 0.0, -1.0), (0.0, 1.0, 1.0, 0.0)


def tilt(
    recordings: Annotated[list[Path], typer.Argument(help="Recordings (.mcap) or folders, rests inside.")],
    out: Annotated[Path, typer.Option(help="TOML to write.")],
    tilts: Annotated[
        Path | None,
        typer.Option(help="CSV along_x_deg,along_y_deg: each axis above the horizontal, a row per rest."),
    ] = None,
    tilt_sigma_deg: Annotated[
        float, typer.Option(help="How sure those are (gauge blocks, their base).")
    ] = 0.01,
    table_map: Annotated[Path | None, typer.Option(help="Map that says how the table pulls.")] = None,
    least_s: Annotated[float, typer.Option(help="Shorter rests are left out.")] = 3.0,
    plot: Annotated[Path | None, typer.Option(help="PNG to draw as well.")] = None,
    vehicle: Annotated[str | None, typer.Option(help="Of a recording with several vehicles.")] = None,
) -> None:
    """Scale and axis misalignment of the accelerometers by tilting, or by turning on a tilted table.

    Either set the landed vehicle on gauge blocks, tilted along x and along y, both ways, and write the tilts
    down (--tilts). Or tilt the table by some mrad and land the vehicle at eight headings: the stars say them.
    Then the common scale and turn of both axes stay unknown unless --table-map says how the table pulls.
    Rests are found by themselves; knocks and touches in them are named and cut out.

    Example: groundstation calibrate tilt level.mcap tilted.mcap --tilts tilts.csv --out tilt.toml
    """
    if not least_s >= 1.0:
        raise UsageError(f"--least-s must be 1 s or more, found {least_s:g}.")
    if not tilt_sigma_deg > 0.0:
        raise UsageError(f"--tilt-sigma-deg must be above zero, found {tilt_sigma_deg:g}.")
    known = None if table_map is None else _map(table_map)
    rests: list[Rest] = []
    cut: list[str] = []
    for path in recordings:
        data = read_flight(path, vehicle, with_stars=not (tilts is not None and path.is_dir()))
        found, named = _rests_of(path, data, least_s, known)
        rests += found
        cut += named
    if tilts is not None:
        rests = _with_tilts(tilts, rests, math.radians(tilt_sigma_deg))
    slope_std = None
    if known is not None:
        slope_std = math.hypot(RELEVELLING_SIGMA_M_S2, float(np.median(known.std_x_m_s2)))
    try:
        result = tilt_axes(rests, slope_std)
    except ValueError as error:
        raise UsageError(f"{', '.join(path.name for path in recordings)}: {error}.") from None
    _write(out, recordings, result, cut, len(rests))
    if plot is not None:
        from groundstation.cli.calibration_plots import plot_tilt

        plot_tilt(result, plot)


def _map(path: Path) -> TableMap:
    try:
        return TableMap.load(path)
    except FileError as error:
        raise UsageError(str(error)) from None


def _rests_of(
    path: Path, data: FusionFolder, least_s: float, known: TableMap | None
) -> tuple[list[Rest], list[str]]:
    """Return the rests of one recording in order, and what was cut out of them."""
    imu, rests, cut = data.imu, [], []
    finite = imu[np.isfinite(imu[:, 1:4]).all(axis=1)]
    try:
        spans = find_rests(finite[:, 0], finite[:, 1:4], least_s, _loudest(data.noise))
    except ValueError as error:
        raise UsageError(f"{path}: {error}.") from None
    for start_s, stop_s in spans:
        inside = (imu[:, 0] > start_s) & (imu[:, 0] <= stop_s)
        try:
            offset = zero_offset(imu[inside, 0], imu[inside, 1:4], imu[inside, 4])
        except NotARest:
            continue  # too disturbed to be one
        cut += [f"{path.name}: {_words(each)}" for each in offset.disturbances]
        stars = data.stars[(data.stars[:, 0] > start_s) & (data.stars[:, 0] <= stop_s)]
        heading, heading_std = _heading(stars[:, 4], data.noise.star_sigma_heading_rad)
        slope = (0.0, 0.0)
        if known is not None and len(stars):
            slope = known.acceleration_m_s2(float(np.median(stars[:, 2])), float(np.median(stars[:, 3])))
        rests.append(
            Rest(
                (float(offset.mean[1]), float(offset.mean[2])),
                (float(offset.std[1]), float(offset.std[2])),
                heading_rad=heading,
                heading_std_rad=heading_std,
                slope_m_s2=slope,
            )
        )
    return rests, cut


def _loudest(noise: NoiseModel) -> Array:
    """Return (3,) sigmas of a packet that the stated noise cannot explain any more."""
    density = (noise.gyro_density_rad_s_rthz, noise.acc_density_m_s2_rthz, noise.acc_density_m_s2_rthz)
    return np.asarray(LOUDER_THAN_STATED * np.array(density) / math.sqrt(noise.packet_period_s))


def _words(cut: Disturbance) -> str:
    span = f"from {cut.start_s:.2f} to {cut.end_s:.2f} s"
    return f"{cut.kind} in {cut.channel} {span}, {cut.size:.2g} {UNITS[cut.channel]}"


def _heading(seen_rad: Array, sigma_rad: float) -> tuple[float | None, float]:
    """Return the heading that most fixes of a rest agree on, and its sigma; None without fixes."""
    if not len(seen_rad):
        return None, 0.0
    apart = np.abs(np.angle(np.exp(1j * (seen_rad[:, None] - seen_rad[None, :]))))
    middle = float(seen_rad[int(np.argmin(np.median(apart, axis=1)))])
    off = np.angle(np.exp(1j * (seen_rad - middle)))
    good = off[np.abs(off) < 5.0 * sigma_rad + 1e-6]
    return middle + float(good.mean()), max(sigma_rad / math.sqrt(len(good)), 1e-6)


def _with_tilts(path: Path, rests: list[Rest], sigma_rad: float) -> list[Rest]:
    table = np.radians(read_table(path, TILT_COLUMNS))
    if len(table) != len(rests):
        raise UsageError(
            f"{path} gives {len(table)} tilts, but the recordings hold {len(rests)} rests: "
            "one row per rest, in their order."
        )
    if not (np.abs(table) < math.radians(20.0)).all():
        raise UsageError(f"{path}: a tilt must be within 20 deg, found {np.degrees(np.abs(table).max()):g}.")
    return [
        Rest(
            rest.reading_m_s2, rest.reading_std_m_s2, (float(along[0]), float(along[1])), sigma_rad,
            rest.heading_rad, rest.heading_std_rad, rest.slope_m_s2,
        )
        for rest, along in zip(rests, table, strict=True)
    ]  # fmt: skip


def _write(out: Path, recordings: list[Path], found: TiltAxes, cut: list[str], rests: int) -> None:
    std = np.sqrt(np.diag(found.covariance))
    names = ("acc_offset_x", "acc_offset_y", "acc_scale_x", "acc_cross_xy", "acc_cross_yx", "acc_scale_y")
    values = [*found.offset_m_s2.tolist(), *found.matrix.ravel().tolist()]
    quantities = {
        name: Quantity(values[k] if found.is_known(k) else math.nan, float(std[k]), "m/s^2" if k < 2 else "1")
        for k, name in enumerate(names)
    }
    quantities["acc_scale_difference"] = Quantity(*combination(found, DIFFERENCE), "1")
    quantities["acc_shear"] = Quantity(*combination(found, SHEAR), "1")
    rms = np.sqrt((found.residual_m_s2**2).mean(axis=0))
    residual = {name: Quantity(float(rms[k]), math.nan, "m/s^2") for k, name in enumerate(("ax", "ay"))}
    notes: dict[str, float | int | str | bool | Sequence[str]] = {
        "rests": rests,
        "chi_square_ratio": round(found.chi_square_ratio, 3),
        "unknown": list(found.unknown),
        "cut": cut,
    }
    now = datetime.now(UTC)
    parts = [provenance_of(path, now) for path in recordings]
    digest = parts[0].recording_sha256
    if len(parts) > 1:
        digest = hashlib.sha256("".join(part.recording_sha256 for part in parts).encode()).hexdigest()
    provenance = Provenance(", ".join(part.recording for part in parts), digest, now)
    title = "Scale, axes and offsets of the accelerometers"
    result = CalibrationResult(title, provenance, quantities, residual, notes)
    write_atomically({out: [result.to_toml()]})
    print(f"{rests} rests, chi-square ratio {found.chi_square_ratio:.2f}")
    for line in cut:
        print(f"  cut out: {line}")
    for name, quantity in quantities.items():
        if math.isnan(quantity.value):
            print(f"{name}: not told by these rests")
        else:
            print(f"{name} = {quantity.value:.6g} ± {quantity.std:.2g} {quantity.unit}")
    for words in found.unknown:
        print(f"unknown: {words}")
