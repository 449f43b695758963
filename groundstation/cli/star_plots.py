"""Figures of the sky's calibrations."""

import os
import tempfile
from pathlib import Path

import matplotlib.figure
import numpy as np
from numpy.typing import NDArray

from groundstation.cli.errors import UsageError


def plot_residuals(path: Path, residual_px: NDArray[np.float64], title: str) -> None:
    """Draw residuals (m, 2) of an adjustment: as a cloud, and their distribution.

    Raises:
        UsageError: The file cannot be written.
    """
    figure = matplotlib.figure.Figure(figsize=(10, 4.5), layout="constrained")
    cloud, spread = figure.subplots(1, 2)
    cloud.plot(residual_px[:, 0], residual_px[:, 1], ".", markersize=2)
    cloud.set(xlabel="u residual (px)", ylabel="v residual (px)", aspect="equal", title=title)
    cloud.grid(visible=True, alpha=0.3)
    sigma = max(float(np.sqrt((residual_px**2).mean())), 1e-9)
    spread.hist(residual_px.ravel(), bins=80, density=True, alpha=0.7)
    axis = np.linspace(-5.0 * sigma, 5.0 * sigma, 200)
    spread.plot(axis, np.exp(-0.5 * (axis / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi)))
    spread.set(xlabel="residual (px)", title=f"RMS {sigma:.4f} px per axis")
    save_figure(figure, path)


def plot_delay(
    path: Path, t_s: NDArray[np.float64], residual_rad: NDArray[np.float64], delay_s: float
) -> None:
    """Draw what is left of the headings after the delay.

    Raises:
        UsageError: The file cannot be written.
    """
    figure = matplotlib.figure.Figure(figsize=(9, 4), layout="constrained")
    axes = figure.subplots()
    axes.plot(t_s, np.degrees(residual_rad), ".")
    axes.set(xlabel="t (s)", ylabel="heading residual (deg)", title=f"delay {1e3 * delay_s:.2f} ms")
    axes.grid(visible=True, alpha=0.3)
    save_figure(figure, path)


def save_figure(figure: matplotlib.figure.Figure, path: Path) -> None:
    """Write a PNG whole or not at all.

    Raises:
        UsageError: The file cannot be written.
    """
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
        with os.fdopen(handle, "wb") as file:
            figure.savefig(file, format="png", dpi=110)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except OSError as error:
        raise UsageError(f"{path}: cannot be written ({error.strerror or error}).") from error
