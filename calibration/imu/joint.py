"""Every constant of a mock-up at once from one flight, by the smoother."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from calibration.imu.figures import draw_residuals
from calibration.imu.gyro_scale import LARGEST_SCALE, LEAST_SHARE
from calibration.imu.procedures import gyro_scale_by_turns
from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Quantity, quantity_lines
from groundstation.fusion.constants import CONSTANTS
from groundstation.fusion.estimator import FixOutcome
from groundstation.fusion.flight_data import FlightData, estimate
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.offline import OfflineSmoother

WIDE_GATE = 60.0
"""While a scale is still unknown, good fixes look worse than they are."""
MOST_STARTS = 2
"""A filter that begins anew more often has not followed the flight."""
LARGEST_ACC_TERM = 0.25
"""A scale or an axis of the accelerometers further off is none of a sensor."""


def constants_of_flight(data: FlightData) -> Outcome:
    """Re-estimate every constant of sensors, mounting, camera delay and slope.

    Raises:
        CalibrationRefusedError: No two fixes agree, or readings and fixes contradict each other.
    """
    smoother = OfflineSmoother(widened(data.noise))
    _, accounts = estimate(data, smoother)
    quantities = constants(smoother)
    complaint = _complaint_about(quantities, accounts)
    if complaint is not None:
        raise CalibrationRefusedError(f"{complaint}: {_cause(data)}")
    used = [account for account in accounts if account.reason == "used"]
    residual = _residuals(data, smoother, used)
    spread = np.sqrt((residual[:, 1:] ** 2).mean(axis=0))
    return Outcome(
        title="Constants of one mock-up, jointly from a flight",
        summary="\n".join(quantity_lines(quantities)),
        quantities=quantities,
        residual={
            "x": Quantity(float(spread[0]), math.nan, "m"),
            "y": Quantity(float(spread[1]), math.nan, "m"),
            "heading": Quantity(float(spread[2]), math.nan, "rad"),
        },
        notes={"fixes": len(used), "fixes_refused": len(accounts) - len(used)},
        draw=partial(draw_residuals, residual, np.array([account.nis for account in used])),
    )


def _complaint_about(quantities: dict[str, Quantity], accounts: list[FixOutcome]) -> str | None:
    """Return why these cannot be the constants of a mock-up; None if they can."""
    starts = sum(account.reason == "starts the estimate again" for account in accounts)
    used = sum(account.used for account in accounts)
    if starts > MOST_STARTS or used < LEAST_SHARE * len(accounts):
        return (
            f"IMU and fixes do not go together: {used} of {len(accounts)} fixes could be used, and the "
            f"estimate began anew {starts} times"
        )
    for name, found in quantities.items():
        limit = LARGEST_SCALE if name == "gyro_scale" else LARGEST_ACC_TERM
        if name.startswith(("gyro_scale", "acc_scale", "acc_cross")) and abs(found.value) > limit:
            return f"{name} would be {found.value:.3g}, which is none of a sensor"
    return None


def _cause(data: FlightData) -> str:
    """Return the likely cause, by what the turns say."""
    try:
        gyro_scale_by_turns(data)
    except CalibrationRefusedError as error:
        if "heading" in str(error) or str(error).startswith("omega"):
            return str(error)
    return "look at sign, unit and order of the accelerometers and of x and y"


def widened(noise: NoiseModel) -> NoiseModel:
    """Return a model that believes no earlier calibration of the constants."""
    return replace(
        noise,
        gyro_scale_sigma=0.05,
        acc_scale_sigma=0.05,
        imu_offset_sigma_m=0.02,
        tempco_sigma_ratio=1.0,
        fix_delay_sigma_s=0.02,
        calibrated=(),
        gate_nis=WIDE_GATE,
    )


def constants(smoother: OfflineSmoother) -> dict[str, Quantity]:
    """Return every constant with its sigma after all has been fed.

    Raises:
        CalibrationRefusedError: No pose was ever found.
    """
    nodes = smoother.finish().nodes
    if not nodes:
        raise CalibrationRefusedError("no two star fixes agreed, so nothing can be calibrated")
    last = nodes[-1]
    return {
        name: Quantity(float(last.x[k]), math.sqrt(max(0.0, float(last.P[k, k]))), unit)
        for name, (k, unit) in CONSTANTS.items()
    }


def _residuals(data: FlightData, smoother: OfflineSmoother, used: list[FixOutcome]) -> np.ndarray:
    """Return (m, 4) exposure s, and fix less smoothed x, y, heading."""
    states = [state for state in smoother.states() if state is not None]
    t = np.array([state.t_ns for state in states]) * 1e-9
    pose = np.array([state[1:4] for state in states])
    wanted = {round(account.t_exposure_ns / 1e3) for account in used}
    rows = []
    for exposure, _, x, y, heading in data.stars.tolist():
        if math.isfinite(exposure) and round(exposure * 1e6) in wanted:
            at = [float(np.interp(exposure, t, column)) for column in pose.T]
            rows.append([exposure, x - at[0], y - at[1], math.remainder(heading - at[2], math.tau)])
    return np.array(rows).reshape(-1, 4)
