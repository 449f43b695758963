"""What a fix and a rest say about the error states."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion import error_state as es
from groundstation.fusion.estimator import Fix
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import Segment
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.trace import Corrected

Array = NDArray[np.float64]

REST_VELOCITY_M_S = 1e-6
"""Sigma of a landed vehicle's velocity: none, but not singular."""
MAX_REST_SPREAD = 2.5
"""A rest whose readings spread wider than this many sigmas of the white noise was not one."""


def predict_fix(fix: Fix, x: Array, rate_read_rad_s: float, noise: NoiseModel) -> tuple[Array, Array]:
    """Return innovation (3,) of x, y, heading and its Jacobian (3, 23) at the exposure.

    The star camera sees the body's origin now; the state is the IMU point's, seen through the sensors'
    low-pass filters. For a first-order filter the lag is undone exactly: heading + lag * rate, p + lag * v.

    Args:
        fix: pose of the body's origin.
        x: (23,) nominal state at the exposure.
        rate_read_rad_s: the gyro's reading at the exposure.
        noise: lags.
    """
    H = np.zeros((3, es.SIZE))
    w = rate_read_rad_s - x[es.GYRO_BIAS]
    theta = x[es.THETA] + noise.gyro_lag_s * w
    c, s = math.cos(theta), math.sin(theta)
    rx, ry = x[es.LEVER_X], x[es.LEVER_Y]
    lx, ly = c * rx - s * ry, s * rx + c * ry
    lag = noise.acc_lag_s
    late = x[es.FIX_DELAY]
    rate = (x[es.VX] + w * ly, x[es.VY] - w * lx, w)
    z = np.array(
        [
            fix.x_m - (x[es.PX] + lag * x[es.VX] - lx + late * rate[0]),
            fix.y_m - (x[es.PY] + lag * x[es.VY] - ly + late * rate[1]),
            math.remainder(fix.heading_rad - theta - late * w, math.tau),
        ]
    )
    H[:, es.FIX_DELAY] = rate
    H[0, es.PX] = H[1, es.PY] = H[2, es.THETA] = 1.0
    H[0, es.VX] = H[1, es.VY] = lag
    H[0, es.THETA], H[1, es.THETA] = ly, -lx
    H[0, es.LEVER_X], H[0, es.LEVER_Y] = -c, s
    H[1, es.LEVER_X], H[1, es.LEVER_Y] = -s, -c
    H[2, es.GYRO_BIAS] = -noise.gyro_lag_s
    return z, H


def fix_covariance(fix: Fix, x: Array, rate_rad_s: float, noise: NoiseModel) -> Array:
    """Return the fix's covariance (3, 3) with what an exposure's uncertain stamp adds to a moving vehicle."""
    moved = np.array([x[es.VX], x[es.VY], rate_rad_s]) * noise.fix_time_sigma_s
    return np.asarray(fix.covariance + moved[:, None] * moved)


def take_pose(fix: Fix, x: Array, P: Array, near_heading_rad: float, velocity_sigma_m_s: float) -> None:
    """Set pose and velocity from one fix alone, in place; what is known of biases and table stays.

    Args:
        fix: pose of the body's origin.
        x: (23,) nominal state.
        P: (23, 23) covariance.
        near_heading_rad: the heading is unwrapped to lie within half a turn of this.
        velocity_sigma_m_s: how fast the vehicle may be; the velocity is set to zero.
    """
    c, s = math.cos(fix.heading_rad), math.sin(fix.heading_rad)
    rx, ry = x[es.LEVER_X], x[es.LEVER_Y]
    lx, ly = c * rx - s * ry, s * rx + c * ry
    x[es.THETA] = near_heading_rad + math.remainder(fix.heading_rad - near_heading_rad, math.tau)
    x[es.VX : es.VY + 1] = 0.0
    x[es.PX], x[es.PY] = fix.x_m + lx, fix.y_m + ly
    P[: es.MOVING] = 0.0
    P[:, : es.MOVING] = 0.0
    order = [es.PX, es.PY, es.THETA]
    P[np.ix_(order, order)] = fix.covariance
    P[es.VX, es.VX] = P[es.VY, es.VY] = velocity_sigma_m_s**2
    arm = np.eye(es.SIZE)  # the fix is of the body's origin: errors of heading and lever move the IMU point
    arm[es.PX, es.THETA], arm[es.PY, es.THETA] = -ly, lx
    arm[es.PX, es.LEVER_X], arm[es.PX, es.LEVER_Y] = c, -s
    arm[es.PY, es.LEVER_X], arm[es.PY, es.LEVER_Y] = s, c
    P[:] = arm @ P @ arm.T


def stand(x: Array, P: Array) -> Array:
    """Stop the vehicle in place: velocity zero, as known as can be; return the transition's rows (5, 23)."""
    v = slice(es.VX, es.VY + 1)
    x[v] = 0.0
    P[v] = 0.0
    P[:, v] = 0.0
    P[es.VX, es.VX] = P[es.VY, es.VY] = REST_VELOCITY_M_S**2
    rows = np.eye(es.MOVING, es.SIZE)
    rows[v] = 0.0
    return rows


class RestDisturbed(ValueError):  # noqa: N818 - it is a finding about the data
    """The readings spread too wide for a rest."""


def learn_rest(
    x: Array, P: Array, segment: Segment, noise: NoiseModel, table_map: SlopeGrid | None = None
) -> Corrected | None:
    """Correct biases and slope in place by the mean of packets at rest.

    At rest the accelerometers read bias - R(heading)^T slope, the gyro its bias.

    Returns:
        The correction, or None if there is no packet.

    Raises:
        RestDisturbed: the readings spread too wide for a rest; nothing was changed.
    """
    good = segment.is_hole == 0.0
    n = int(good.sum())
    if n == 0:  # between fast fixes lie one or two packets: together they are the rest
        return None
    readings = np.array([segment.rate_rad_s[good], segment.ax_m_s2[good], segment.ay_m_s2[good]])
    density = np.array(
        [noise.gyro_density_rad_s_rthz, noise.acc_density_m_s2_rthz, noise.acc_density_m_s2_rthz]
    )
    sigma = density / math.sqrt(noise.packet_period_s)
    if (readings.std(axis=1) > MAX_REST_SPREAD * sigma).any():
        raise RestDisturbed
    warmth = float(segment.warmth_k[good].mean())
    c, s = math.cos(x[es.THETA]), math.sin(x[es.THETA])
    gx, gy = x[es.SLOPE_X] + x[es.WAVE_X], x[es.SLOPE_Y] + x[es.WAVE_Y]
    if table_map is not None:
        known_x, known_y = table_map.at(float(x[es.PX]), float(x[es.PY]))
        gx, gy = gx + known_x, gy + known_y
    H = np.zeros((3, es.SIZE))
    H[0, es.GYRO_BIAS], H[0, es.GYRO_TEMPCO] = 1.0, warmth
    H[1, es.ACC_BIAS_X], H[1, es.ACC_TEMPCO_X] = 1.0, warmth
    H[2, es.ACC_BIAS_Y], H[2, es.ACC_TEMPCO_Y] = 1.0, warmth
    for k in (es.SLOPE_X, es.WAVE_X):
        H[1, k], H[1, k + 1] = -c, -s
        H[2, k], H[2, k + 1] = s, -c
    expected = np.array(
        [
            x[es.GYRO_BIAS] + x[es.GYRO_TEMPCO] * warmth,
            x[es.ACC_BIAS_X] + x[es.ACC_TEMPCO_X] * warmth - (c * gx + s * gy),
            x[es.ACC_BIAS_Y] + x[es.ACC_TEMPCO_Y] * warmth - (c * gy - s * gx),
        ]
    )
    PH = P[:, : es.SIZE] @ H.T
    S = H @ PH[: es.SIZE] + np.diag(sigma**2 / n)
    weight: Array = np.asarray(np.linalg.inv(S), dtype=np.float64)
    K = PH @ weight
    z = readings.mean(axis=1) - expected
    x += K @ z
    P -= K @ S @ K.T
    return Corrected(H, K, weight, z)


def reported(x: Array, rate_rad_s: float) -> Array:
    """Return the Jacobian (6, 23) of x, y, heading, vx, vy, rate of the centre of mass."""
    H = np.zeros((6, es.SIZE))
    c, s = math.cos(x[es.THETA]), math.sin(x[es.THETA])
    rx, ry = x[es.LEVER_X], x[es.LEVER_Y]
    lx, ly = c * rx - s * ry, s * rx + c * ry
    w = rate_rad_s
    H[0, es.PX] = H[1, es.PY] = H[2, es.THETA] = H[3, es.VX] = H[4, es.VY] = 1.0
    H[0, es.THETA], H[1, es.THETA] = ly, -lx
    H[0, es.LEVER_X], H[0, es.LEVER_Y], H[1, es.LEVER_X], H[1, es.LEVER_Y] = -c, s, -s, -c
    H[3, es.THETA], H[4, es.THETA] = w * lx, w * ly
    H[3, es.GYRO_BIAS], H[4, es.GYRO_BIAS] = -ly, lx
    H[3, es.LEVER_X], H[3, es.LEVER_Y] = w * s, w * c
    H[4, es.LEVER_X], H[4, es.LEVER_Y] = -w * c, w * s
    H[5, es.GYRO_BIAS], H[5, es.GYRO_SCALE] = -1.0, -w
    return H


def add_scale_in_time(variance: list[float], P: Array, rate_rad_s: float) -> None:
    """Add to the heading's coefficients, in place, what the gyro's scale adds while turning at a rate.

    The rate's error is -(b_g + w s_g); `LateFix.variance_in_time` has the first part.
    """
    g, k, w = es.GYRO_BIAS, es.GYRO_SCALE, rate_rad_s
    variance[11] -= 2.0 * w * float(P[es.THETA, k])
    variance[12] += float(2.0 * w * P[g, k] + w * w * P[k, k])
