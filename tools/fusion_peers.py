# ruff: noqa: N806 - F, H, Q, S as in the literature
"""Other people's filters behind the estimator's contract, for comparison only."""

from __future__ import annotations

import importlib.util
import math

import numpy as np

from groundstation.fusion.estimator import Array, Counters, Fix, FixAccount, ImuPacket, PlanarState
from groundstation.fusion.noise import NoiseModel

NS = 1e-9


class FilterpyPeer:
    """filterpy's KalmanFilter as a textbook user would take it.

    Eight states (heading, velocity, position of the IMU point, gyro and accelerometer bias), one predict per
    packet at the exposure, an update per fix with an innovation gate that opens after four refusals, then
    open loop to now. The bias walks fast enough to follow a slope in turning body axes. No slope, no
    scale, no packet screen beyond a limit.
    """

    GATE = 25.0
    LIMIT = (1.5, 0.15)
    """rad/s, m/s^2 from zero."""

    def __init__(self, noise: NoiseModel) -> None:
        from filterpy.kalman import KalmanFilter

        self.noise, self.counters = noise, Counters()
        self._kf = KalmanFilter(dim_x=8, dim_z=3)
        self._kf.x = np.zeros((8, 1))
        self._kf.P = np.diag([0.0] * 5 + [0.9**2, 0.15**2, 0.15**2])
        self._packets: list[tuple[float, float, float, float, float]] = []
        self._at = 0.0
        self._has_pose = False
        self._refusals = 0
        self._rest_until = 0.0
        self._now: np.ndarray | None = None
        self._newest = ImuPacket(0, 0.01, 0.0, 0.0, 0.0, 25.0)

    def begin_rest(self, t_ns: int) -> None:
        """Stand still until told."""
        del t_ns
        self._rest_until = math.inf

    def end_rest(self, t_ns: int) -> None:
        """Move."""
        self._rest_until = t_ns * NS

    def add_imu(self, packet: ImuPacket) -> PlanarState | None:
        """Integrate open loop."""
        t = packet.t_ns * NS
        if not (
            abs(packet.omega_rad_s) < self.LIMIT[0]
            and max(abs(packet.ax_m_s2), abs(packet.ay_m_s2)) < self.LIMIT[1]
        ):
            packet = packet._replace(
                omega_rad_s=self._newest.omega_rad_s,
                ax_m_s2=self._newest.ax_m_s2,
                ay_m_s2=self._newest.ay_m_s2,
            )
        self._newest = packet
        row = (t, packet.dt_s, packet.omega_rad_s, packet.ax_m_s2, packet.ay_m_s2)
        self._packets.append(row)
        if self._now is None:
            return None
        self._now = self._step(self._now, row)
        return self.state()

    def _step(self, x: np.ndarray, row: tuple[float, float, float, float, float]) -> np.ndarray:
        t, dt, omega, ax, ay = row
        if t <= self._rest_until:
            return x
        out = x.copy()
        w = omega - x[5]
        c, s = math.cos(x[0] + 0.5 * w * dt), math.sin(x[0] + 0.5 * w * dt)
        fx, fy = ax - x[6], ay - x[7]
        a = np.array([c * fx - s * fy, s * fx + c * fy])
        out[3:5] += x[1:3] * dt + 0.5 * a * dt * dt
        out[1:3] += a * dt
        out[0] += w * dt
        return out

    def _predict(self, row: tuple[float, float, float, float, float]) -> None:
        kf, (t, dt, omega, ax, ay) = self._kf, row
        x = kf.x[:, 0]
        if t <= self._rest_until:
            H = np.zeros((3, 8))
            H[:, 5:] = np.eye(3)
            n = self.noise
            variance = (
                np.array([n.gyro_density_rad_s_rthz, n.acc_density_m_s2_rthz, n.acc_density_m_s2_rthz]) ** 2
                / dt
            )
            kf.update(np.array([[omega], [ax], [ay]]), R=np.diag(variance), H=H)
            return
        c, s = math.cos(x[0]), math.sin(x[0])
        fx, fy = ax - x[6], ay - x[7]
        F = np.eye(8)
        F[0, 5] = -dt
        F[1, 0], F[2, 0] = -(s * fx + c * fy) * dt, (c * fx - s * fy) * dt
        F[1, 6:], F[2, 6:] = [-c * dt, s * dt], [-s * dt, -c * dt]
        F[3, 1] = F[4, 2] = dt
        Q = np.zeros((8, 8))
        Q[0, 0] = self.noise.gyro_density_rad_s_rthz**2 * dt
        Q[1, 1] = Q[2, 2] = (3.0 * self.noise.acc_density_m_s2_rthz) ** 2 * dt
        Q[6, 6] = Q[7, 7] = (1.5e-3) ** 2 * dt
        moved = self._step(x, row)
        kf.predict(F=F, Q=Q)
        kf.x = moved[:, None]

    def add_fix(self, fix: Fix) -> FixAccount:
        """Predict to the exposure, update, and run open loop to now."""
        t, nan = fix.t_exposure_ns * NS, math.nan
        rx, ry = self.noise.imu_offset_x_m, self.noise.imu_offset_y_m
        if not self._has_pose:
            c, s = math.cos(fix.heading_rad), math.sin(fix.heading_rad)
            self._kf.x[[0, 3, 4], 0] = fix.heading_rad, fix.x_m + c * rx - s * ry, fix.y_m + s * rx + c * ry
            self._kf.P[0, 0], self._kf.P[3, 3], self._kf.P[4, 4] = fix.cov[2, 2], fix.cov[0, 0], fix.cov[1, 1]
            self._has_pose, reason, nis = True, "starts the estimate", nan
            z = np.full(3, nan)
        else:
            while self._packets and self._packets[0][0] <= t:
                self._predict(self._packets.pop(0))
            x = self._kf.x[:, 0]
            c, s = math.cos(x[0]), math.sin(x[0])
            lx, ly = c * rx - s * ry, s * rx + c * ry
            z = np.array(
                [
                    fix.x_m - (x[3] - lx),
                    fix.y_m - (x[4] - ly),
                    math.remainder(fix.heading_rad - x[0], math.tau),
                ]
            )
            H = np.zeros((3, 8))
            H[0, 3] = H[1, 4] = H[2, 0] = 1.0
            H[0, 0], H[1, 0] = ly, -lx
            S = H @ self._kf.P @ H.T + fix.cov
            nis = float(z @ np.linalg.solve(S, z))
            reason = "used" if nis < self.GATE or self._refusals >= 4 else "outside the gate"
            self._refusals = 0 if reason == "used" else self._refusals + 1
            if reason == "used":
                self._kf.update((z + H @ x)[:, None], R=fix.cov, H=H)
        now = self._kf.x[:, 0].copy()
        for row in self._packets:
            now = self._step(now, row)
        self._now = now
        used = reason != "outside the gate"
        return FixAccount(fix.t_exposure_ns, used, reason, float(z[0]), float(z[1]), float(z[2]), nis)

    def settled(self) -> list[FixAccount]:
        """Nothing waits here."""
        return []

    def state(self) -> PlanarState | None:
        """Return the state of the centre of mass."""
        if self._now is None:
            return None
        x, w = self._now, self._newest.omega_rad_s - self._now[5]
        c, s = math.cos(x[0]), math.sin(x[0])
        lx = c * self.noise.imu_offset_x_m - s * self.noise.imu_offset_y_m
        ly = s * self.noise.imu_offset_x_m + c * self.noise.imu_offset_y_m
        if self._newest.t_ns * NS <= self._rest_until:
            w = 0.0
        sigma = np.sqrt(np.diag(self._kf.P)[[3, 4, 0]])
        return PlanarState(
            self._newest.t_ns, x[3] - lx, x[4] - ly, x[0], x[1] + w * ly, x[2] - w * lx, w,
            x[5], x[6], x[7], sigma[0], sigma[1], sigma[2], False,
        )  # fmt: skip

    def covariance(self) -> Array:
        """Not offered."""
        raise NotImplementedError


def peers() -> dict[str, type]:
    """Return the peers whose libraries are installed."""
    return {"filterpy": FilterpyPeer} if importlib.util.find_spec("filterpy") else {}
