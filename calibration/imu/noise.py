"""White noise and bias instability of a long rest: what it shows, what it is too short for, and a verdict."""

from __future__ import annotations

import math
from functools import partial

from calibration.imu import figures
from calibration.imu.allan import LEAST_PAIRS, AllanDeviation, allan_deviation, stretches_on_ticks
from calibration.imu.channels import UNITS
from calibration.imu.everyday_units import everyday, lines_of
from calibration.imu.procedures import readings_of, rest_of
from calibration.outcome import Note, Outcome
from calibration.result import Quantity
from groundstation.fusion.flight_data import FlightData

AS_STATED = 0.1
"""A measured noise this near to the stated one, or within three sigma, is as stated."""
SIGMAS = 3.0
FLOORS_S = (100.0, 1000.0)
"""Averaging times at which the floor of such sensors may lie, for the advice on how long to record."""


def noise_at_rest(data: FlightData) -> Outcome:
    """Find white noise and bias instability from the Allan deviation of a long rest.

    Raises:
        CalibrationRefusedError: It is too short, no rest, or no channel is alive.
    """
    rest = data.at_rest()
    found, alive = rest_of(data)
    wild = {d.start_s for d in found.disturbances if d.kind == "wild packet"}
    rest = rest[[t not in wild for t in rest[:, 0].tolist()]]
    stretches, spacing_s = stretches_on_ticks(
        rest[:, 0], readings_of(rest, alive), data.noise.packet_period_s
    )
    curves = {
        name: allan_deviation([stretch[:, k] for stretch in stretches], spacing_s)
        for k, name in enumerate(alive.names)
    }
    length_s = spacing_s * sum(len(stretch) for stretch in stretches)
    quantities: dict[str, Quantity] = {}
    notes: dict[str, Note] = {"duration_s": length_s, "stretches": len(stretches)}
    words = [f"{length_s:.4g} s at rest" + (f" in {len(stretches)} pieces" if len(stretches) > 1 else "")]
    for name, curve in curves.items():
        numbers, also = _numbers(name, curve)
        stated = data.noise.gyro_density_rad_s_rthz if name == "omega" else data.noise.acc_density_m_s2_rthz
        verdict = _verdict(curve, stated, f"{UNITS[name]} sqrt(s)")
        words += [*lines_of(numbers), *also, f"  {name}: {verdict}"]
        quantities |= numbers
        notes[f"{name}_instability_is_upper_limit"] = not curve.is_floor_seen
        notes[f"{name}_verdict"] = verdict
    return Outcome(
        title="White noise and bias instability (Allan deviation)",
        summary="\n".join(words),
        quantities=quantities,
        residual={},
        notes=notes,
        draw=partial(figures.draw_allan, curves, dict(UNITS)),
        warnings=alive.complaints,
    )


def _numbers(name: str, curve: AllanDeviation) -> tuple[dict[str, Quantity], list[str]]:
    """Return what the curve tells in numbers, and what it is too short for, in words."""
    unit = UNITS[name]
    numbers: dict[str, Quantity] = {}
    words = []
    if math.isfinite(curve.random_walk):
        numbers[f"{name}_random_walk"] = Quantity(
            curve.random_walk, curve.random_walk_sigma, f"{unit} sqrt(s)"
        )
    else:
        words.append(
            f"  {name}_random_walk: from {curve.tau_s[0]:.2g} to {curve.tau_s[-1]:.2g} s the curve never "
            f"falls as white noise does: the sensor's filter or a disturbance sets it; record longer"
        )
    if curve.is_floor_seen:
        numbers[f"{name}_bias_instability"] = Quantity(
            curve.bias_instability, curve.bias_instability_sigma, unit
        )
        words.append(f"  {name}_bias_instability: the floor lies at {curve.bias_instability_tau_s:.3g} s")
        return numbers, words
    need = " and ".join(
        f"{_span(floor_s * (LEAST_PAIRS + 1))} for one at {floor_s:g} s" for floor_s in FLOORS_S
    )
    words.append(
        f"  {name}_bias_instability: not seen, below {curve.bias_instability:.3g} {unit} "
        f"({everyday(curve.bias_instability, unit)}); this record shows a floor up to "
        f"{curve.tau_s[-1]:.3g} s, a tenth of its length; needed are {need}"
    )
    return numbers, words


def _verdict(curve: AllanDeviation, stated: float, unit: str) -> str:
    if not math.isfinite(curve.random_walk):
        return f"white noise not found; stated is {stated:.4g} {unit} ({everyday(stated, unit)})"
    ratio, doubt = curve.random_walk / stated, curve.random_walk_sigma / stated
    word = "as stated"
    if abs(ratio - 1.0) > max(AS_STATED, SIGMAS * doubt):
        word = "NOISIER than stated" if ratio > 1.0 else "quieter than stated"
    return (
        f"white noise {word}, {ratio:.3g} times the {stated:.4g} {unit} ({everyday(stated, unit)}) of rig or "
        "meta.json"
    )


def _span(span_s: float) -> str:
    return f"{span_s / 60.0:.3g} min" if span_s < 7200.0 else f"{span_s / 3600.0:.3g} h"
