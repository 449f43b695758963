"""Figures of the IMU's calibrations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from calibration.imu.allan import AllanDeviation
from calibration.imu.gyro_scale import GyroScale
from calibration.imu.temperature import TemperatureSlope
from calibration.imu.tilt_axes import TiltAxes
from calibration.imu.zero_offset import ZeroOffset
from groundstation.files.png import new_figure
from groundstation.fusion.published_stretch import PublishedStretch

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Draw = Callable[[], "Figure"]


def _axes(figure: Figure, rows: int) -> list[Any]:
    return list(np.atleast_1d(figure.subplots(rows, 1, sharex=True)))


def draw_rest(t_s: Array, readings: Array, found: ZeroOffset, labels: Sequence[str]) -> Figure:
    """Draw the rest's packets (n, c), their mean, and what was cut out."""
    figure = new_figure(9.0, 7.0)
    axes_of = _axes(figure, len(labels))
    for k, (axes, label) in enumerate(zip(axes_of, labels, strict=True)):
        axes.plot(t_s, readings[:, k], ".", markersize=2, color="0.5", label="packets")
        axes.axhline(
            found.mean[k], color="tab:blue", label=f"mean {found.mean[k]:.6f} ± {found.mean_sigma[k]:.1g}"
        )
        reach = 6.0 * found.packet_sigma[k]
        axes.set_ylim(found.mean[k] - reach, found.mean[k] + reach)
        axes.set_ylabel(label)
        for number, cut in enumerate(found.disturbances):
            once = None if number else f"{len(found.disturbances)} cut out"
            axes.axvspan(cut.start_s - 0.02, cut.end_s + 0.02, color="tab:red", alpha=0.3, label=once)
        axes.legend(loc="upper right", ncols=3, fontsize=8)
    axes.set_xlabel("time, s")
    return figure


def draw_temperature(found: TemperatureSlope, labels: Sequence[str]) -> Figure:
    """Draw block means against temperature with the fitted lines."""
    figure = new_figure(8.0, 7.0)
    heat = found.block_temperature_c
    axes_of = _axes(figure, len(labels))
    for k, (axes, label) in enumerate(zip(axes_of, labels, strict=True)):
        axes.plot(heat, found.block_mean[:, k], ".", color="0.4")
        axes.plot(heat, found.at_reference[k] + found.slope[k] * (heat - found.reference_c), color="tab:blue")
        axes.set_ylabel(label)
        axes.set_title(
            f"{found.slope[k]:.3g} ± {found.slope_sigma[k]:.1g} {label.split()[1]} per °C", fontsize=9
        )
    axes.set_xlabel("temperature, °C")
    return figure


def draw_scale(found: GyroScale) -> Figure:
    """Draw the heading residuals of the turns."""
    figure = new_figure(8.0, 4.0)
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
    return figure


def draw_allan(curves: dict[str, AllanDeviation], units: dict[str, str]) -> Figure:
    """Draw the Allan deviations with their white-noise slopes."""
    figure = new_figure(8.0, 8.0)
    for axes, (name, curve) in zip(_axes(figure, len(curves)), curves.items(), strict=True):
        axes.errorbar(curve.tau_s, curve.deviation, curve.sigma, fmt=".-", markersize=3, linewidth=0.8)
        axes.plot(
            curve.tau_s, curve.random_walk / np.sqrt(curve.tau_s), "--", color="0.5", label="white noise"
        )
        lowest = "floor" if curve.is_floor_seen else "lowest point: an upper limit"
        axes.axhline(curve.deviation.min(), color="tab:red", linewidth=0.8, label=lowest)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylabel(f"{name}, {units[name].replace('^2', '²')}")
        axes.legend(fontsize=8)
    axes.set_xlabel("averaging time, s")
    return figure


def draw_residuals(residual: Array, nis: Array) -> Figure:
    """Draw fix less smoothed pose (m, 4: s, m, m, rad), and the filter's NIS."""
    figure = new_figure(9.0, 8.0)
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
    return figure


def draw_tilt(found: TiltAxes) -> Figure:
    """Draw what is left of each rest's readings, with the sigmas expected of it."""
    figure = new_figure(9.0, 6.0)
    number = np.arange(1, len(found.residual_m_s2) + 1)
    for k, axes in enumerate(_axes(figure, 2)):
        axes.errorbar(
            number,
            1e3 * found.residual_m_s2[:, k],
            1e3 * found.residual_sigma_m_s2[:, k],
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
    return figure


def draw_offset_fit(residual_m: Array) -> Figure:
    """Draw how far the integrated way of the fit misses the fixes, (2, m)."""
    figure = new_figure(8.0, 5.0)
    number = np.arange(2, residual_m.shape[1] + 2)
    for k, axes in enumerate(_axes(figure, 2)):
        axes.plot(number, 1e3 * residual_m[k], ".-", linewidth=0.6)
        axes.axhline(0.0, color="0.6", linewidth=0.8)
        axes.set_ylabel(f"fix less integration, {'xy'[k]}, mm")
        axes.grid(alpha=0.3)
    axes.set_xlabel("fix of the stretch")
    return figure


def draw_published_offsets(found: PublishedStretch) -> Figure:
    """Draw the integrated way with and without the offsets, the fixes, and what is left at each fix."""
    figure = new_figure(9.0, 8.0)
    axes = figure.subplots(3, 1, sharex=True)
    fit = found.fit
    after = found.way.at(fit.alpha_m_s2, fit.beta_m_s2)
    for row, (place, label) in enumerate(zip(axes, ("x, m", "y, m"), strict=False)):
        place.plot(found.fix_s, found.star_m[row], ".", color="0.4", label="fixes")
        place.plot(found.end_s, found.way.f_m[row], "--", color="tab:red", label="zeros of the rest")
        place.plot(found.end_s, after[row], "-", color="tab:blue", label="and fitted offsets")
        place.set_ylabel(label)
    axes[0].legend(loc="best", fontsize=8)
    for row, label in enumerate(("x", "y")):
        axes[2].plot(found.fix_s, 1e3 * fit.residual_m[row], ".-", label=label)
    axes[2].axhline(0.0, color="0.7")
    axes[2].set_ylabel("way - fixes, mm")
    axes[2].set_xlabel("time, s")
    axes[2].legend(loc="best", fontsize=8)
    return figure
