"""From a recording to what its laboratory is: read, smoothed, fitted, smoothed again with the noise found."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calibration.flights import opened
from calibration.laboratory.camera import camera_of, scatter_of
from calibration.laboratory.findings import Findings
from calibration.laboratory.recorded_flight import RecordedFlight, read_flight
from calibration.laboratory.smoothed_motion import (
    SmoothedMotion,
    smoothed,
    table_findings,
    table_pull,
)
from calibration.laboratory.thrust_course import POLL_S
from calibration.laboratory.valve_findings import (
    drag_findings,
    model_of,
    noise_findings,
    pushes_of,
    valve_findings,
)
from calibration.laboratory.valve_fit import ValveFit, fit_valves
from calibration.outcome import CalibrationRefusedError
from groundstation.cli.progress import Progress
from groundstation.declarations.errors import UsageError
from groundstation.declarations.rig import Rig
from groundstation.parts.stars.sections import StarsOfType, StarsOfVehicle

GUESS_S = 0.05
"""Of the camera's delay, where neither rig nor fixes state one."""
OUTLIERS = 0.02
"""Share of the packets that is worth a word."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedVehicle:
    """One vehicle.

    Attributes:
        name: Its name.
        flight: What was read of it.
        motion: It, smoothed.
        fit: Of its valves.
        findings: What was found, by keys of its table of the emulated laboratory.
    """

    name: str
    flight: RecordedFlight
    motion: SmoothedMotion
    fit: ValveFit
    findings: Findings


@dataclass(frozen=True, slots=True, eq=False)
class FittedLaboratory:
    """A laboratory.

    Attributes:
        rig: Of the recording.
        table: Of the table, by its keys.
        vehicles: Those that flew.
        grounded: Those that did not, with the reason.
        warnings: What may be wrong, one sentence each.
    """

    rig: Rig
    table: Findings
    vehicles: tuple[FittedVehicle, ...]
    grounded: dict[str, str]
    warnings: tuple[str, ...]


def fit_laboratory(
    source: Path, vehicle: str | None, rig_path: Path | None, progress: Progress
) -> FittedLaboratory:
    """Fit every vehicle that flew in a recording, or one.

    Raises:
        CalibrationRefusedError: None flew, or what flew cannot be fitted.
        RecordingError: The recording cannot be read.
        UsageError: It holds no rig, no such vehicle, or not what its fusion received.
    """
    if source.is_dir():
        raise UsageError(f"{source} is a folder: valves are commanded in a recording (.mcap) alone.")
    with opened(source, rig_path) as (recording, rig):
        if vehicle is not None and vehicle not in rig.vehicles:
            raise UsageError(f"{source} has no vehicle {vehicle!r}; there are {', '.join(rig.vehicles)}.")
        grounded: dict[str, str] = {}
        flights = []
        for name in rig.vehicles if vehicle is None else (vehicle,):
            try:
                flights.append(read_flight(recording, rig, name, _camera_delay(rig, name)))
            except CalibrationRefusedError as error:
                grounded[name] = str(error)
        if not flights:
            raise CalibrationRefusedError("; ".join(grounded.values()))
        fits, motions = [], []
        for flight in flights:
            progress(f"smoothing {flight.vehicle}", math.nan)
            first = smoothed(recording, rig, flight)
            fit = fit_valves(flight, model_of(rig, flight.vehicle), first.motion, progress)
            span_s = flight.windows.polls * POLL_S
            densities = (fit.spreads.rate_rad_s * span_s**0.5, fit.spreads.force_m_s2 * span_s**0.5)
            progress(f"smoothing {flight.vehicle} with the noise that was found", math.nan)
            motions.append(smoothed(recording, rig, flight, densities, scatter_of(flight)))
            fits.append(fit)
    progress("fitting the table", math.nan)
    logs = [motion.log for motion in motions]
    pull = table_pull(rig, logs)
    vehicles = [
        FittedVehicle(
            flight.vehicle, flight, motion, fit, _of_vehicle(rig, flight, motion, fit, matrix, progress)
        )
        for flight, motion, fit, matrix in zip(flights, motions, fits, pull.matrix, strict=True)
    ]
    warnings = [
        f"{each.name}: {each.fit.outliers} of {each.fit.packets} packets fit no push of the valves and were "
        "left out"
        for each in vehicles
        if each.fit.outliers > OUTLIERS * each.fit.packets
    ]
    return FittedLaboratory(rig, table_findings(rig, pull, logs), tuple(vehicles), grounded, tuple(warnings))


def _camera_delay(rig: Rig, vehicle: str) -> float | None:
    camera = rig.of_type(vehicle, StarsOfType).star_camera
    return (
        camera.delay[0] if camera is not None and rig.vehicle(vehicle, StarsOfVehicle).star_camera else None
    )


def _of_vehicle(
    rig: Rig,
    flight: RecordedFlight,
    motion: SmoothedMotion,
    fit: ValveFit,
    matrix: tuple[np.ndarray, np.ndarray],
    progress: Progress,
) -> Findings:
    kind, model = rig.type_of(flight.vehicle), model_of(rig, flight.vehicle)
    force_x, force_y, torque = kind.model().effectiveness()
    pushes = pushes_of(fit, model, matrix, motion.gyro_scale)
    found = valve_findings(
        fit, pushes, kind.mass_kg, torque / np.hypot(force_x, force_y), flight.link_sigma_s
    )
    inertia = found.found.get("inertia_kg_m2")
    found += drag_findings(fit, kind.mass_kg, kind.inertia_kg_m2 if inertia is None else inertia.value)
    found += noise_findings(fit, flight, model)
    stated_s = (flight.fix_arrival_ns - flight.fix_stamp_ns) * 1e-9
    guess_s = max(0.0, float(np.median(stated_s))) if len(stated_s) else GUESS_S
    found += camera_of(flight, motion, fit.reading.rate_rad_s, guess_s or GUESS_S, progress)
    return replace(
        found,
        assumed=(
            f"mass_kg = {kind.mass_kg:g}: of a push only force over mass and torque over inertia are seen",
            "where valves sit and push, and where the IMU sits, as the rig states",
            "the timer of the IMU's adapter as the rig states (ftdi_latency_s); frames leave 0.5 ms late",
        ),
    )
