"""Readings between two exposures as one factor: pre-integrated in the frame of the first exposure's body.

After Forster, Carlone, Dellaert, Scaramuzza, "On-Manifold Preintegration for Real-Time Visual-Inertial
Odometry" (2017), in the plane: sums that do not depend on pose, velocity and slope, and to first order on the
biases.
"""

import math

import numpy as np

from bench.fusion.planar import (
    ACC,
    GYRO,
    HEADING,
    POSITION,
    SCALE,
    SIZE,
    SLOPE,
    VELOCITY,
    Array,
    Reading,
    process_noise,
    shaking_variance,
)
from groundstation.fusion.noise import NoiseModel

_HELD_VARIANCE = 1e-10
"""Of pose and velocity of what stands still, so that covariances can be inverted."""
_CONSTANT_VARIANCE = 1e-10
"""Of the scale, a constant, for the same reason."""


class Stretch:
    """Sums over readings.

    Args:
        start: State (11,) before, whose biases and scale the sums are linearised about.
        noise: Of the sensors.
    """

    def __init__(self, start: Array, noise: NoiseModel) -> None:
        self.noise = noise
        self._biases, self._scale = np.array(start[5:8]), float(start[SCALE])
        self.span_s = self.moving_s = self.rest_s = 0.0
        self.rest_sum = np.zeros(3)
        """Readings at rest (omega, ax, ay) times their length."""
        self._turn, self._velocity, self._place = 0.0, np.zeros(2), np.zeros(2)
        self._velocity_by, self._place_by = np.zeros((2, 3)), np.zeros((2, 3))
        self._covariance = np.zeros((5, 5))

    def rest(self, reading: Reading) -> None:
        """Add a reading at rest."""
        self.span_s += reading.dt_s
        self.rest_s += reading.dt_s
        self.rest_sum += np.array(reading[2:]) * reading.dt_s

    def move(self, reading: Reading) -> None:
        """Add a reading in motion."""
        dt = reading.dt_s
        gyro, bias_x, bias_y = self._biases.tolist()
        rate = (reading.rate_rad_s - gyro) * (1.0 - self._scale)
        half = self._turn + 0.5 * rate * dt
        c, s = math.cos(half), math.sin(half)
        fx, fy = reading.ax_m_s2 - bias_x, reading.ay_m_s2 - bias_y
        force = np.array([c * fx - s * fy, s * fx + c * fy])
        across = np.array([-force[1], force[0]])
        by = np.column_stack((-(self.moving_s + 0.5 * dt) * across, [-c, -s], [s, -c]))
        self._place += self._velocity * dt + 0.5 * dt * dt * force
        self._place_by += self._velocity_by * dt + 0.5 * dt * dt * by
        self._velocity += force * dt
        self._velocity_by += by * dt
        self._turn += rate * dt
        step = np.eye(5)
        step[1:3, 0], step[3:, 0] = across * dt, 0.5 * dt * dt * across
        step[3, 1] = step[4, 2] = dt
        self._covariance = step @ self._covariance @ step.T
        self._covariance[0, 0] += self.noise.gyro_density_rad_s_rthz**2 * dt
        self._covariance[[1, 2], [1, 2]] += shaking_variance(self.noise, dt)
        self.moving_s += dt
        self.span_s += dt

    def covariance(self, heading_rad: float) -> Array:
        """Of the predicted state (11, 11)."""
        covariance = process_noise(self.noise, self.span_s)
        turn = np.eye(5)
        turn[1:3, 1:3] = turn[3:, 3:] = _rotation(heading_rad)
        covariance[:5, :5] = turn @ self._covariance @ turn.T
        covariance[range(5), range(5)] += _HELD_VARIANCE
        covariance[SCALE, SCALE] += _CONSTANT_VARIANCE
        return covariance

    def predict(self, x: Array) -> tuple[Array, Array]:
        """The state after the stretch (11,) and its derivative by the state before (11, 11)."""
        t, turn = self.moving_s, _rotation(x[HEADING])
        off, stretched = x[5:8] - self._biases, x[SCALE] - self._scale
        velocity = self._velocity + self._velocity_by @ off
        place = self._place + self._place_by @ off
        out, by = x.copy(), np.eye(SIZE)
        out[HEADING] += (1.0 - stretched) * self._turn - t * off[0]
        out[VELOCITY] += turn @ velocity + t * x[SLOPE]
        out[POSITION] += t * x[VELOCITY] + turn @ place + 0.5 * t * t * x[SLOPE]
        quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
        by[HEADING, GYRO], by[HEADING, SCALE] = -t, -self._turn
        by[VELOCITY, HEADING], by[POSITION, HEADING] = quarter @ turn @ velocity, quarter @ turn @ place
        by[VELOCITY, GYRO], by[VELOCITY, ACC] = (
            turn @ self._velocity_by[:, 0],
            turn @ self._velocity_by[:, 1:],
        )
        by[POSITION, GYRO], by[POSITION, ACC] = turn @ self._place_by[:, 0], turn @ self._place_by[:, 1:]
        by[VELOCITY, SLOPE], by[POSITION, SLOPE] = t * np.eye(2), 0.5 * t * t * np.eye(2)
        by[POSITION, VELOCITY] = t * np.eye(2)
        return out, by


def _rotation(angle_rad: float) -> Array:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s], [s, c]])
