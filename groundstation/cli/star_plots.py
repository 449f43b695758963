"""Figures of the sky's calibrations."""

import os
import tempfile
from pathlib import Path

import matplotlib.figure
import numpy as np

from groundstation.cli.errors import UsageError
from groundstation.star_tracking.sky_adjustment import Adjusted


def plot_adjustment(path: Path, adjusted: Adjusted, title: str) -> None:
    """Draw the residuals of an adjustment: as a cloud, and their distribution.

    Raises:
        UsageError: The file cannot be written.
    """
    figure = matplotlib.figure.Figure(figsize=(10, 4.5), layout="constrained")
    cloud, spread = figure.subplots(1, 2)
    used, residual = adjusted.used, adjusted.residual_px
    cloud.plot(*residual[used].T, ".", markersize=2)
    cloud.set(xlabel="u residual (px)", ylabel="v residual (px)", aspect="equal", title=title)
    cloud.grid(visible=True, alpha=0.3)
    spread.hist(residual[used].ravel(), bins=80, density=True, alpha=0.7)
    sigma = max(adjusted.rms_px, 1e-9)
    axis = np.linspace(-5.0 * sigma, 5.0 * sigma, 200)
    spread.plot(axis, np.exp(-0.5 * (axis / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi)))
    spread.set(xlabel="residual (px)", title=f"RMS {adjusted.rms_px:.4f} px, {int((~used).sum())} clipped")
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
