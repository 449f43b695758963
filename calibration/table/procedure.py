"""The table's slope and waves from flights: fitted, checked on a flight, put into words."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from calibration.outcome import CalibrationRefusedError
from calibration.result import provenance_of
from calibration.table.equations import FlightPriors, flight_equations
from calibration.table.from_fit import map_of
from calibration.table.prediction import check_outages
from calibration.table.separability import separability
from calibration.table.smoothed_flights import Bounds, Source
from calibration.table.surface_basis import SurfaceBasis
from calibration.table.surface_fit import SurfaceFit, fit_surface
from groundstation.fusion.levelling import Levelling
from groundstation.fusion.table_map import G_M_S2, MapProvenance, TableMap

EDGE_M = 0.2
"""How far beyond the flown area a map reaches where no rig gives the table's edges."""
NOISE_WARNING = 1.5
SHORTEST_WAVE_M = 0.4
PRIORS = FlightPriors()


def map_of_sources(
    sources: list[Source], bounds_m: Bounds | None = None, shortest_wave_m: float = SHORTEST_WAVE_M
) -> tuple[SurfaceFit, TableMap]:
    """Fit the table's surface, with every constant of each flight, and lay it on a grid.

    Raises:
        CalibrationRefusedError: The flights do not suffice.
    """
    try:
        basis = SurfaceBasis.over(bounds_m or _table_of(sources), shortest_wave_m)
    except ValueError as error:
        raise CalibrationRefusedError(str(error)) from error
    logs = [log for source in sources for log in source.logs]
    fit = fit_surface([flight_equations(log, basis, PRIORS) for log in logs], basis)
    return fit, map_of(fit, _provenance(fit, sources))


def summary_of(fit: SurfaceFit, made: TableMap, advice: Levelling | None) -> list[str]:
    """Return what was found, a sentence each."""
    sigma = np.sqrt(made.mean_covariance_m2_s4.diagonal())
    lines = [
        "Mean acceleration "
        + ", ".join(
            f"{axis} {1e3 * made.mean_m_s2[k]:+.3f} ± {1e3 * sigma[k]:.3f} mm/s²"
            f" ({1e3 * made.mean_m_s2[k] / G_M_S2:+.3f} mrad)"
            for k, axis in enumerate("xy")
        )
        + ".",
        f"Waves about it {1e3 * fit.waviness_m_s2:.2f} mm/s² per axis over {fit.length_m:.2f} m; "
        f"{fit.unknowns_learned:.0f} numbers learned from {fit.rows} measurements, "
        f"chi-square ratio {fit.chi_square_ratio:.2f}.",
    ]
    if fit.chi_square_ratio > NOISE_WARNING:
        lines.append(
            "Attention: the flights are noisier than their rig says, so all sigmas are "
            f"{fit.noise_factor**0.5:.1f} times larger "
            "(fix sigma too small, knocks of the valves, shocks of the floor?)."
        )
    lines += [verdict.sentence() for verdict in separability(fit)]
    return lines + (advice.sentences() if advice is not None else [])


def check_on(source: Source, made: TableMap) -> list[str]:
    """Return how well a flight that the map was not learned from is predicted without fixes.

    Raises:
        CalibrationRefusedError: It is too short.
    """
    lines = []
    for log in source.logs:
        found = check_outages(log, made.accelerations_m_s2, made.mean_m_s2, PRIORS)
        lines.append(
            f"{log.name}: {found.outages} outages of {found.length_s:g} s end "
            f"{1e3 * found.with_map_m:.1f} mm off with the map, "
            f"{1e3 * found.mean_only_m:.1f} mm with the mean slope, "
            f"{1e3 * found.without_m:.1f} mm with none."
        )
    return lines


def _provenance(fit: SurfaceFit, sources: list[Source]) -> MapProvenance:
    now = datetime.now(UTC)
    notes: dict[str, float | str] = {
        "waviness_m_s2": fit.waviness_m_s2,
        "length_m": fit.length_m,
        "shortest_wave_m": fit.basis.shortest_wave_m,
        "noise_factor": fit.noise_factor,
    }
    for number, verdict in enumerate(separability(fit), start=1):
        notes[f"bias_and_slope_{number}"] = verdict.sentence()
    return MapProvenance(
        now,
        {source.path.name: provenance_of(source.path, now).recording_sha256 for source in sources},
        fit.chi_square_ratio,
        sum(flight.duration_s for flight in fit.flights),
        notes,
    )


def _table_of(sources: list[Source]) -> Bounds:
    """Return the table's edges by the rig, else what was flown and a little more."""
    for source in sources:
        if source.bounds_m is not None:
            return source.bounds_m
    places = np.concatenate([log.position_table_m for source in sources for log in source.logs])
    (x_min, y_min), (x_max, y_max) = places.min(axis=0) - EDGE_M, places.max(axis=0) + EDGE_M
    return float(x_min), float(x_max), float(y_min), float(y_max)
