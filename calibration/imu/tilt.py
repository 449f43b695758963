"""Scale and axes of the accelerometers from rests at several tilts: rests found, tilts given, axes fitted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from calibration.imu.channels import alive_channels
from calibration.imu.figures import draw_tilt
from calibration.imu.procedures import words_of
from calibration.imu.rest_search import find_rests
from calibration.imu.tilt_axes import Rest, TiltAxes, combination, tilt_axes
from calibration.imu.zero_offset import NotARest, zero_offset
from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Quantity, quantity_lines
from groundstation.declarations.errors import UsageError
from groundstation.files.number_tables import load_table
from groundstation.fusion.flight_data import Array, FlightData
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.slope_grid import RELEVELLING_SIGMA_M_S2
from groundstation.fusion.table_map import TableMap

TILT_COLUMNS = ("along_x_deg", "along_y_deg")
LARGEST_TILT_DEG = 20.0
LOUDER_THAN_STATED = 5.0
NAMES = ("acc_offset_x", "acc_offset_y", "acc_scale_x", "acc_cross_xy", "acc_cross_yx", "acc_scale_y")
DIFFERENCE, SHEAR = (1.0, 0.0, 0.0, -1.0), (0.0, 1.0, 1.0, 0.0)


@dataclass(frozen=True, slots=True)
class RestsFound:
    """Rests in their order, and what was cut out of them, in words."""

    rests: tuple[Rest, ...] = ()
    cut: tuple[str, ...] = ()

    def __add__(self, later: RestsFound) -> RestsFound:
        return RestsFound(self.rests + later.rests, self.cut + later.cut)


@dataclass(frozen=True, slots=True, eq=False)
class Tilts:
    """Tilts that were set by hand: the file, and each axis above the horizontal, (n, 2) rad."""

    path: Path
    along_rad: Array


def load_tilts(path: Path) -> Tilts:
    """Read along_x_deg, along_y_deg: a row per rest.

    Raises:
        FileError: The file is missing or wrong, or a tilt is too large.
    """
    most = dict.fromkeys(TILT_COLUMNS, LARGEST_TILT_DEG)
    return Tilts(path, np.radians(load_table(path, TILT_COLUMNS, most=most).numbers))


def rests_of(name: str, data: FlightData, least_s: float, known: TableMap | None) -> RestsFound:
    """Find the rests of one recording.

    Args:
        name: Of the recording, for people.
        data: The recording.
        least_s: Shorter ones are left out.
        known: How the table pulls.

    Raises:
        CalibrationRefusedError: There are too few packets, or a channel is stuck.
    """
    imu, found = data.imu, RestsFound()
    alive = alive_channels(imu[:, 1:4], data.noise)
    if alive.complaints:
        raise CalibrationRefusedError("; ".join(alive.complaints))
    finite = imu[np.isfinite(imu[:, 1:4]).all(axis=1)]
    for start_s, stop_s in find_rests(finite[:, 0], finite[:, 1:4], least_s, _loudest(data.noise)):
        inside = (imu[:, 0] > start_s) & (imu[:, 0] <= stop_s)
        try:
            offset = zero_offset(imu[inside, 0], imu[inside, 1:4], imu[inside, 4])
        except NotARest:
            continue  # too disturbed to be one
        stars = data.stars[(data.stars[:, 0] > start_s) & (data.stars[:, 0] <= stop_s)]
        heading, heading_sigma = _heading(stars[:, 4], data.noise.star_sigma_heading_rad)
        slope = (0.0, 0.0)
        if known is not None and len(stars):
            slope = known.acceleration_m_s2(float(np.median(stars[:, 2])), float(np.median(stars[:, 3])))
        rest = Rest(
            (float(offset.mean[1]), float(offset.mean[2])),
            (float(offset.mean_sigma[1]), float(offset.mean_sigma[2])),
            heading_rad=heading,
            heading_sigma_rad=heading_sigma,
            slope_m_s2=slope,
        )
        cut = tuple(f"{name}: {words_of(each)}" for each in offset.disturbances)
        found += RestsFound((rest,), cut)
    return found


def axes_of(found: RestsFound, tilts: Tilts | None, tilt_sigma_rad: float, known: TableMap | None) -> Outcome:
    """Fit scale, axes and offsets of the accelerometers.

    Args:
        found: The rests.
        tilts: Of each, if they were set by hand.
        tilt_sigma_rad: How sure those are.
        known: How the table pulls.

    Raises:
        UsageError: There are more or fewer tilts than rests.
        CalibrationRefusedError: The rests are too few or too alike.
    """
    rests: Sequence[Rest] = found.rests
    if tilts is not None:
        rests = _with_tilts(tilts, rests, tilt_sigma_rad)
    slope_sigma = None
    if known is not None:
        slope_sigma = math.hypot(RELEVELLING_SIGMA_M_S2, float(np.median(known.sigma_x_m_s2)))
    fit = tilt_axes(list(rests), slope_sigma)
    return _outcome(fit, len(rests), found.cut)


def _loudest(noise: NoiseModel) -> Array:
    """Return (3,) sigmas of a packet that the stated noise cannot explain any more."""
    density = (noise.gyro_density_rad_s_rthz, noise.acc_density_m_s2_rthz, noise.acc_density_m_s2_rthz)
    return np.asarray(LOUDER_THAN_STATED * np.array(density) / math.sqrt(noise.packet_period_s))


def _heading(seen_rad: Array, sigma_rad: float) -> tuple[float | None, float]:
    """Return the heading that most fixes of a rest agree on, and its sigma; None without fixes."""
    if not len(seen_rad):
        return None, 0.0
    apart = np.abs(np.angle(np.exp(1j * (seen_rad[:, None] - seen_rad[None, :]))))
    middle = float(seen_rad[int(np.argmin(np.median(apart, axis=1)))])
    off = np.angle(np.exp(1j * (seen_rad - middle)))
    good = off[np.abs(off) < 5.0 * sigma_rad + 1e-6]
    return middle + float(good.mean()), max(sigma_rad / math.sqrt(len(good)), 1e-6)


def _with_tilts(tilts: Tilts, rests: Sequence[Rest], sigma_rad: float) -> list[Rest]:
    if len(tilts.along_rad) != len(rests):
        raise UsageError(
            f"{tilts.path} gives {len(tilts.along_rad)} tilts, but the recordings hold {len(rests)} rests: "
            "one row per rest, in their order."
        )
    return [
        replace(rest, tilt_rad=(float(along[0]), float(along[1])), tilt_sigma_rad=sigma_rad)
        for rest, along in zip(rests, tilts.along_rad, strict=True)
    ]


def _outcome(found: TiltAxes, rests: int, cut: Sequence[str]) -> Outcome:
    sigma = np.sqrt(np.diag(found.covariance))
    values = [*found.offset_m_s2.tolist(), *found.matrix.ravel().tolist()]
    quantities = {
        name: Quantity(
            values[k] if found.is_known(k) else math.nan, float(sigma[k]), "m/s^2" if k < 2 else "1"
        )
        for k, name in enumerate(NAMES)
    }
    quantities["acc_scale_difference"] = Quantity(*combination(found, DIFFERENCE), "1")
    quantities["acc_shear"] = Quantity(*combination(found, SHEAR), "1")
    rms = np.sqrt((found.residual_m_s2**2).mean(axis=0))
    words = [f"{rests} rests, chi-square ratio {found.chi_square_ratio:.2f}"]
    words += [f"  cut out: {line}" for line in cut]
    for name, quantity in quantities.items():
        is_known = not math.isnan(quantity.value)
        words += (
            quantity_lines({name: quantity}) if is_known else [f"{name}: these rests do not determine it"]
        )
    words += [f"unknown: {what}" for what in found.unknown]
    return Outcome(
        title="Scale, axes and offsets of the accelerometers",
        summary="\n".join(words),
        quantities=quantities,
        residual={name: Quantity(float(rms[k]), math.nan, "m/s^2") for k, name in enumerate(("ax", "ay"))},
        notes={
            "rests": rests,
            "chi_square_ratio": round(found.chi_square_ratio, 3),
            "unknown": list(found.unknown),
            "cut": list(cut),
        },
        draw=partial(draw_tilt, found),
    )
