"""Figures of calibrations; matplotlib loads only when one is asked for."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from calibration.imu.allan import AllanDeviation
from calibration.imu.gyro_scale import GyroScale
from calibration.imu.temperature import TemperatureSlope
from calibration.imu.tilt_axes import TiltAxes
from calibration.imu.zero_offset import ZeroOffset
from groundstation.cli.errors import UsageError

Array = NDArray[np.float64]


def _save(figure: Figure, path: Path) -> None:
    """Write a PNG whole or not at all."""
    FigureCanvasAgg(figure)
    part = path.with_name(f".{path.name}.part")
    try:
        figure.savefig(part, format="png", dpi=110)
        os.replace(part, path)  # noqa: PTH105 - the call that promises atomicity
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error.strerror}.") from None
    finally:
        part.unlink(missing_ok=True)


def _axes(figure: Figure, rows: int) -> list[Any]:
    return list(np.atleast_1d(figure.subplots(rows, 1, sharex=True)))


def plot_rest(rest: Array, found: ZeroOffset, path: Path) -> None:
    """Draw the rest's packets (n, 5), its mean, and what was cut out."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    for k, (axes, label) in enumerate(
        zip(_axes(figure, 3), ("omega, rad/s", "ax, m/s²", "ay, m/s²"), strict=True)
    ):
        axes.plot(rest[:, 0], rest[:, k + 1], ".", markersize=2, color="0.5", label="packets")
        axes.axhline(found.mean[k], color="tab:blue", label=f"mean {found.mean[k]:.6f} ± {found.std[k]:.1g}")
        reach = 6.0 * found.packet_sigma[k]
        axes.set_ylim(found.mean[k] - reach, found.mean[k] + reach)
        axes.set_ylabel(label)
        for number, cut in enumerate(found.disturbances):
            once = None if number else f"{len(found.disturbances)} cut out"
            axes.axvspan(cut.start_s - 0.02, cut.end_s + 0.02, color="tab:red", alpha=0.3, label=once)
        axes.legend(loc="upper right", ncols=3, fontsize=8)
    axes.set_xlabel("time, s")
    _save(figure, path)


def plot_temperature(found: TemperatureSlope, path: Path) -> None:
    """Draw block means against temperature with the fitted lines."""
    figure = Figure(figsize=(8, 7), layout="constrained")
    heat = found.block_temperature_c
    for k, (axes, label) in enumerate(
        zip(_axes(figure, 3), ("omega, rad/s", "ax, m/s²", "ay, m/s²"), strict=True)
    ):
        axes.plot(heat, found.block_mean[:, k], ".", color="0.4")
        axes.plot(heat, found.at_reference[k] + found.slope[k] * (heat - found.reference_c), color="tab:blue")
        axes.set_ylabel(label)
        axes.set_title(
            f"{found.slope[k]:.3g} ± {found.slope_std[k]:.1g} {label.split()[1]} per °C", fontsize=9
        )
    axes.set_xlabel("temperature, °C")
    _save(figure, path)


def plot_scale(found: GyroScale, path: Path) -> None:
    """Draw the heading residuals of the turns."""
    figure = Figure(figsize=(8, 4), layout="constrained")
    (axes,) = _axes(figure, 1)
    residual = np.degrees(found.residual_rad)
    axes.plot(found.fix_s[found.is_used], residual[found.is_used], ".", label=f"{found.used} used")
    limit = 1.5 * float(np.abs(residual[found.is_used]).max()) + 1e-6
    refused = ~found.is_used
    clipped = np.clip(residual[refused], -limit, limit)
    axes.plot(found.fix_s[refused], clipped, "x", color="tab:red", label=f"{found.refused} refused")
    axes.set_xlabel("exposure, s")
    axes.set_ylabel("star heading less gyro, °")
    axes.legend()
    _save(figure, path)


def plot_allan(curves: dict[str, AllanDeviation], units: dict[str, str], path: Path) -> None:
    """Draw the Allan deviations with their white-noise slopes."""
    figure = Figure(figsize=(8, 8), layout="constrained")
    for axes, (name, curve) in zip(_axes(figure, len(curves)), curves.items(), strict=True):
        axes.errorbar(curve.tau_s, curve.deviation, curve.std, fmt=".-", markersize=3, linewidth=0.8)
        axes.plot(
            curve.tau_s, curve.random_walk / np.sqrt(curve.tau_s), "--", color="0.5", label="white noise"
        )
        axes.axhline(curve.bias_instability * 0.664, color="tab:red", linewidth=0.8, label="lowest point")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylabel(f"{name}, {units[name].replace('^2', '²')}")
        axes.legend(fontsize=8)
    axes.set_xlabel("averaging time, s")
    _save(figure, path)


def plot_residuals(residual: Array, nis: Array, path: Path) -> None:
    """Draw fix less smoothed pose (m, 4: s, m, m, rad), and the filter's NIS."""
    figure = Figure(figsize=(9, 8), layout="constrained")
    axes = _axes(figure, 4)
    for k, (label, factor) in enumerate((("x, mm", 1e3), ("y, mm", 1e3), ("heading, °", 180.0 / np.pi))):
        axes[k].plot(residual[:, 0], factor * residual[:, k + 1], ".", markersize=4)
        axes[k].axhline(0.0, color="0.6", linewidth=0.8)
        axes[k].set_ylabel(label)
    axes[3].plot(residual[:, 0], nis[: len(residual)], ".", markersize=4)
    axes[3].axhline(3.0, color="tab:blue", linewidth=0.8, label="expected mean")
    axes[3].set_ylabel("NIS")
    axes[3].legend()
    axes[3].set_xlabel("exposure, s")
    _save(figure, path)


def plot_tilt(found: TiltAxes, path: Path) -> None:
    """Draw what is left of each rest's readings, with the sigmas expected of it."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    number = np.arange(1, len(found.residual_m_s2) + 1)
    for k, axes in enumerate(_axes(figure, 2)):
        axes.errorbar(
            number,
            1e3 * found.residual_m_s2[:, k],
            1e3 * found.residual_std_m_s2[:, k],
            fmt="o",
            markersize=4,
        )
        axes.axhline(0.0, color="0.6", linewidth=0.8)
        axes.set_ylabel(f"reading less fit, a{'xy'[k]}, mm/s²")
        axes.grid(alpha=0.3)
    axes.set_xlabel("rest")
    axes.set_xticks(number)
    figure.suptitle(
        f"{len(number)} rests, chi-square ratio {found.chi_square_ratio:.2f}"
        + "".join(f"\nunknown: {words}" for words in found.unknown),
        fontsize=10,
    )
    _save(figure, path)


def plot_offset_fit(residual_m: Array, path: Path) -> None:
    """Draw how far the integrated way of the published fit misses the fixes, (2, m)."""
    figure = Figure(figsize=(8, 5), layout="constrained")
    number = np.arange(2, residual_m.shape[1] + 2)
    for k, axes in enumerate(_axes(figure, 2)):
        axes.plot(number, 1e3 * residual_m[k], ".-", linewidth=0.6)
        axes.axhline(0.0, color="0.6", linewidth=0.8)
        axes.set_ylabel(f"fix less integration, {'xy'[k]}, mm")
        axes.grid(alpha=0.3)
    axes.set_xlabel("fix of the stretch")
    _save(figure, path)
