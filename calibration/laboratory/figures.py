"""The figure of a fitted laboratory: what was left before and after, about pulses and over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from calibration.laboratory.procedure import FittedLaboratory, FittedVehicle
from calibration.laboratory.thrust_course import POLL_S
from calibration.laboratory.valve_findings import model_of
from drivers.valve_bus.messages import VALVES
from groundstation.files.png import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

BEFORE, AFTER = "tab:orange", "tab:blue"
EDGE_S = (-0.02, 0.08)
BIN_S = 0.002
MEAN_S = 0.2
"""Over so long turn rates are averaged, for the eye."""


def draw_laboratory(fitted: FittedLaboratory) -> Figure:
    """Draw a row per vehicle."""
    figure = new_figure(15.0, 4.4 * len(fitted.vehicles))
    axes = figure.subplots(len(fitted.vehicles), 4, squeeze=False)
    for row, vehicle in zip(axes, fitted.vehicles, strict=True):
        _draw_edges(row[0], fitted, vehicle, "opening")
        _draw_edges(row[1], fitted, vehicle, "closing")
        _draw_rates(row[2], vehicle)
        _draw_thrusts(row[3], fitted, vehicle)
        row[0].set_title(f"{vehicle.name}: forces about openings", loc="left", fontsize=10)
    return figure


def _draw_edges(axes: Axes, fitted: FittedLaboratory, vehicle: FittedVehicle, edge: str) -> None:
    """Residual force along each valve's own push, averaged by the time since the edge."""
    fit, flight = vehicle.fit, vehicle.flight
    moments = fit.opened.begin if edge == "opening" else fit.opened.end
    middle = flight.windows.last - 0.5 * (flight.windows.polls - 1)
    bins = np.arange(EDGE_S[0], EDGE_S[1] + BIN_S, BIN_S)
    direction = model_of(fitted.rig, vehicle.name).direction
    for left, colour, label in (
        (fit.force_before_m_s2, BEFORE, "with the rig's values"),
        (fit.force_after_m_s2, AFTER, "with those found"),
    ):
        total, count = np.zeros(len(bins) - 1), np.zeros(len(bins) - 1)
        for valve, moment in zip(fit.opened.valve.tolist(), moments.tolist(), strict=True):
            first = int(np.searchsorted(middle, moment + EDGE_S[0] / POLL_S))
            last = int(np.searchsorted(middle, moment + EDGE_S[1] / POLL_S))
            since = (middle[first:last] - moment) * POLL_S
            along = left[first:last] @ direction[valve]
            total += np.histogram(since, bins, weights=along)[0]
            count += np.histogram(since, bins)[0]
        seen = count > 0
        axes.plot(
            1e3 * (bins[:-1] + 0.5 * BIN_S)[seen], 1e3 * total[seen] / count[seen],
            color=colour, label=label, linewidth=1.2,
        )  # fmt: skip
    axes.axhline(0.0, color="0.6", linewidth=0.6)
    axes.set_title(f"forces about {edge}s", loc="left", fontsize=10)
    axes.set_xlabel(f"since {edge}, ms")
    axes.set_ylabel("left along the push, mm/s²")
    axes.legend(fontsize=8, frameon=False)


def _draw_rates(axes: Axes, vehicle: FittedVehicle) -> None:
    """Turn rate that the valves' pushes do not explain, from the start on."""
    fit, flight = vehicle.fit, vehicle.flight
    seconds = (flight.windows.last - flight.windows.last[0]) * POLL_S
    mean_of = max(1, round(MEAN_S / POLL_S / flight.windows.polls))
    whole = len(seconds) // mean_of * mean_of
    for left, colour, label in (
        (fit.rate_before_rad_s, BEFORE, "with the rig's values"),
        (fit.rate_after_rad_s, AFTER, "with those found"),
    ):
        means = (left - left[:mean_of].mean())[:whole].reshape(-1, mean_of).mean(axis=1)
        axes.plot(seconds[:whole:mean_of], 1e3 * means, color=colour, linewidth=1.0, label=label)
    axes.set_title("turn rate that no push explains", loc="left", fontsize=10)
    axes.set_xlabel("afloat, s")
    axes.set_ylabel("left, mrad/s")
    axes.legend(fontsize=8, frameon=False)


def _draw_thrusts(axes: Axes, fitted: FittedLaboratory, vehicle: FittedVehicle) -> None:
    """Thrust of each valve, with three sigma, beside the rig's."""
    kind = fitted.rig.type_of(vehicle.name)
    for valve in range(VALVES):
        found = vehicle.findings.found.get(f"thrusters.{valve}.thrust_n")
        if found is None:
            axes.annotate("not seen", (valve, kind.valves.thrust_n), rotation=90, fontsize=8, ha="center")
        else:
            axes.errorbar(
                valve, found.value, 3.0 * found.sigma, fmt="o", color=AFTER, capsize=3, markersize=4
            )
    axes.axhline(kind.valves.thrust_n, color=BEFORE, linewidth=1.0)
    axes.set_xticks(range(VALVES))
    axes.set_title("thrust with three sigma; line: the rig's", loc="left", fontsize=10)
    axes.set_xlabel("valve")
    axes.set_ylabel("N")
