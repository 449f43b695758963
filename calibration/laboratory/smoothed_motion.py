"""A flight smoothed: motion at its packets, what fixes are off it, scales of sensors, the table's pull."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibration.flights import fuse
from calibration.laboratory.findings import Findings, Found
from calibration.laboratory.recorded_flight import RecordedFlight
from calibration.laboratory.thrust_course import POLL_S
from calibration.laboratory.valve_columns import Motion
from calibration.outcome import CalibrationRefusedError
from calibration.table.chain import MATRIX
from calibration.table.equations import flight_equations
from calibration.table.flight_log import FlightLog
from calibration.table.procedure import PRIORS, SHORTEST_WAVE_M
from calibration.table.smoothed_flights import Tap, flight_log
from calibration.table.surface_basis import SurfaceBasis
from calibration.table.surface_fit import SurfaceFit, cost_of_waves, fit_surface
from groundstation.declarations.rig import Rig
from groundstation.frames import wrap_angle
from groundstation.fusion import error_state as es
from groundstation.fusion.table_map import G_M_S2
from groundstation.parts.fusion.estimation import rig_noise
from groundstation.recording.reader import Recording

Array = NDArray[np.float64]

SLOPE_SIGMA_M_S2 = 0.02
MOST_WAVINESS_DOUBT = 0.4
"""Of the logarithm of the waviness."""
CELL_M = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedMotion:
    """What a smoother made of a flight; f fixes were used.

    Attributes:
        motion: At the packets.
        start: x, y, heading where it took off.
        fix_left: (f, 3) x, y, heading of fixes less the smoothed ones.
        fix_speed: (f, 3) of the vehicle then.
        fix_variance: (f, 3) that the smoother took for theirs.
        fix_own_variance: (f, 3) of the smoothed ones.
        gyro_scale: Reading over rate less one, and its variance.
        log: For the table.
    """

    motion: Motion
    start: tuple[float, float, float]
    fix_left: Array
    fix_speed: Array
    fix_variance: Array
    fix_own_variance: Array
    gyro_scale: tuple[float, float]
    log: FlightLog


def smoothed(
    recording: Recording,
    rig: Rig,
    flight: RecordedFlight,
    densities: tuple[float, float] | None = None,
    jitter_s: float = 0.0,
) -> SmoothedMotion:
    """Smooth a flight by replaying its fusion.

    Args:
        recording: The recording.
        rig: Of it.
        flight: What was read of it.
        densities: White noise of gyro and accelerometers where it is known better than by the rig.
        jitter_s: Scatter of the exposures about their stamps.

    Raises:
        CalibrationRefusedError: It never had a pose while it flew.
        UsageError: The recording does not hold what fusion received.
    """
    noise = rig_noise(rig, flight.vehicle)
    if densities is not None:
        noise = replace(noise, gyro_density_rad_s_rthz=densities[0], acc_density_m_s2_rthz=densities[1])
    noise = replace(noise, fix_time_sigma_s=max(noise.fix_time_sigma_s, jitter_s))
    tap = Tap(noise)
    fuse(recording, rig, flight.vehicle, tap)
    tap.settled()
    log = flight_log(flight.vehicle, tap)
    states = np.array([tuple(state[:13]) for state in tap.states() if state is not None])
    # setting down is a blow that no accelerometer follows
    began_s = log.end_s[0] - states[0, 0] * 1e-9
    log = _until(log, float(flight.stamp_ns[-1]) * 1e-9 + began_s)
    t = states[:, 0]
    middle = flight.stamp_ns - 0.5 * (flight.windows.polls - 1) * POLL_S * 1e9
    if t[0] > middle[-1]:
        raise CalibrationRefusedError(f"{flight.vehicle} never had a pose while it floated")
    x, y, heading, vx, vy, rate = (np.interp(middle, t, states[:, k]) for k in range(1, 7))
    cosine, sine = np.cos(heading), np.sin(heading)
    body = np.column_stack([cosine * vx + sine * vy, cosine * vy - sine * vx])
    used = [fix for fix in tap.fixes if tap.accounts[fix.t_exposure_ns].used]
    used = [fix for fix in used if max(t[0], middle[0]) <= fix.t_exposure_ns <= min(t[-1], middle[-1])]
    moments = np.array([fix.t_exposure_ns for fix in used], dtype=np.float64)
    at = np.column_stack([np.interp(moments, t, states[:, k]) for k in range(1, 13)])
    poses = np.array([(fix.x_m, fix.y_m, fix.heading_rad) for fix in used]).reshape(-1, 3)
    left = poses - at[:, :3]
    left[:, 2] = [wrap_angle(each) for each in left[:, 2].tolist()]
    variance = np.array([fix.covariance.diagonal() for fix in used]).reshape(-1, 3)
    last = tap.finish().nodes[-1]
    return SmoothedMotion(
        Motion(heading, body, rate),
        (float(x[0]), float(y[0]), float(heading[0])),
        left,
        at[:, 3:6],
        variance,
        at[:, 9:12] ** 2,
        (float(last.x[es.GYRO_SCALE]), float(last.P[es.GYRO_SCALE, es.GYRO_SCALE])),
        log,
    )


def _until(log: FlightLog, end_s: float) -> FlightLog:
    """Return what a log holds until a moment."""
    packets, fixes = int((log.end_s <= end_s).sum()), int((log.fix_s <= end_s).sum())
    return replace(
        log,
        end_s=log.end_s[:packets],
        span_s=log.span_s[:packets],
        force_body_m_s2=log.force_body_m_s2[:packets],
        warmth_k=log.warmth_k[:packets],
        heading_rad=log.heading_rad[:packets],
        position_table_m=log.position_table_m[:packets],
        is_hole=log.is_hole[:packets],
        fix_s=log.fix_s[:fixes],
        fix_position_m=log.fix_position_m[:fixes],
        fix_covariance_m2=log.fix_covariance_m2[:fixes],
        fix_heading_rad=log.fix_heading_rad[:fixes],
        fix_velocity_m_s=log.fix_velocity_m_s[:fixes],
        rests_s=tuple((a, min(b, end_s)) for a, b in log.rests_s if a < end_s),
    )


@dataclass(frozen=True, slots=True, eq=False)
class TablePull:
    """The table by one or several flights, and what they tell of each flight's accelerometers.

    Attributes:
        fit: Of the surface.
        matrix: Per flight, (4,) reading over force less one: xx, xy, yx, yy; and its covariance (4, 4).
    """

    fit: SurfaceFit
    matrix: tuple[tuple[Array, Array], ...]


def table_pull(rig: Rig, logs: list[FlightLog]) -> TablePull:
    """Fit the table's surface with every constant of the flights.

    Raises:
        CalibrationRefusedError: Fewer than five fixes.
    """
    table = rig.table
    basis = SurfaceBasis.over((table.x_min_m, table.x_max_m, table.y_min_m, table.y_max_m), SHORTEST_WAVE_M)
    fit = fit_surface([flight_equations(log, basis, PRIORS) for log in logs], basis, SLOPE_SIGMA_M_S2)
    found = []
    for flight in fit.flights:
        value, covariance = flight.unknowns(fit.shared, fit.shared_covariance)
        found.append((value[MATRIX], covariance[MATRIX, MATRIX]))
    return TablePull(fit, tuple(found))


def table_findings(rig: Rig, pull: TablePull, logs: list[FlightLog]) -> Findings:
    """Return tilt and waviness."""
    fit = pull.fit
    sigma = np.sqrt(fit.shared_covariance.diagonal()[:2]) / G_M_S2
    tilt = -fit.shared[:2] / G_M_S2
    found = {
        f"table.tilt_rad.{axis}": Found(float(tilt[k]), float(sigma[k]), "rad") for k, axis in enumerate("xy")
    }
    share = _flown_share(rig, logs)
    where = f"waves are known where it flew, {100.0 * share:.0f} % of the table"
    doubt = _waviness_doubt(fit)
    unseen = {}
    if doubt < MOST_WAVINESS_DOUBT:
        waviness = fit.waviness_m_s2 / G_M_S2
        found["table.waviness_rad"] = Found(waviness, doubt * waviness, "rad", where)
    else:
        unseen["table.waviness_rad"] = f"{where}: not enough to tell waves from slope"
    unseen["table.waviness_length_m"] = "one flight does not tell the shortest of the waves"
    return Findings(found, unseen)


def _waviness_doubt(fit: SurfaceFit) -> float:
    """Return the sigma of the waviness' logarithm by the curvature of its likelihood."""
    J = np.sum([flight.information for flight in fit.flights], axis=0)
    h = np.sum([flight.vector for flight in fit.flights], axis=0)
    middle, step = np.log([fit.waviness_m_s2, fit.length_m]), 0.1

    def cost(a: float, b: float) -> float:
        return cost_of_waves(J, h, fit.basis, SLOPE_SIGMA_M_S2, middle + step * np.array([a, b]))

    here = cost(0.0, 0.0)
    own = [(cost(a, b) - 2.0 * here + cost(-a, -b)) / step**2 for a, b in ((1.0, 0.0), (0.0, 1.0))]
    mixed = (cost(1.0, 1.0) - cost(1.0, -1.0) - cost(-1.0, 1.0) + cost(-1.0, -1.0)) / (4.0 * step**2)
    left = own[0] - mixed**2 / own[1] if own[1] > 0.0 else own[0]
    return 1.0 / math.sqrt(left) if left > 0.0 else math.inf


def _flown_share(rig: Rig, logs: list[FlightLog]) -> float:
    """Return how much of the table was flown over, by cells."""
    table = rig.table
    cells: set[tuple[int, int]] = set()
    for log in logs:
        cells |= set(map(tuple, np.floor(log.position_table_m / CELL_M).astype(int).tolist()))
    area = (table.x_max_m - table.x_min_m) * (table.y_max_m - table.y_min_m)
    return min(1.0, len(cells) * CELL_M**2 / area)
