"""Demo data of the IMU: a rest that warms up, and a flight with late star fixes, as a host logs them."""

import math
from pathlib import Path
from typing import Any

from drivers.imu_block.protocol import FrameParser, ImuFrame
from drivers.imu_block.sensors import rate_rad_s, specific_force_m_s2, temperature_gyro_c
from drivers.laboratory.channels import Arrival
from drivers.reference.protocol import PoseParser
from firmware_emulator.demo.writing import write_json, write_table
from firmware_emulator.devices.sensor_errors import noise_figures
from firmware_emulator.laboratory import EmulatedLaboratory
from firmware_emulator.plant.motion_state import PollGrid

NS = 1_000_000_000
STEP_NS = 20_000_000
REST_S, FLIGHT_S, LONG_REST_S = 12.0, 70.0, 120.0
LEVER_M = (0.03151, -0.02122)
FIX_SIGMA_M, FIX_SIGMA_RAD, FIX_DELAY_S = 0.001, 0.00087, 0.6
_MASS_KG, _INERTIA_KG_M2 = 11.0, 0.25
_RATE_HZ, _DAMPING = 0.12, 0.8  # of the hand that leads the mock-up
_CIRCLE_M, _CIRCLE_S = 0.35, 28.0
_TURN_RAD_S, _SWAY_RAD, _SWAY_S = 0.30, 0.5, 7.0
IMU_COLUMNS = "t_s,omega_rad_s,ax_m_s2,ay_m_s2,temperature_C"
STAR_COLUMNS = "t_exposure_s,t_arrival_s,x_m,y_m,heading_rad"


def rest(folder: Path, seed: int) -> None:
    """An IMU block from its switching on."""
    imu, _, _ = _log(_laboratory(warm_up_s=60.0), seed, LONG_REST_S, LONG_REST_S)
    _write(folder, imu, [], [], LONG_REST_S, LONG_REST_S)


def flight(folder: Path, seed: int) -> None:
    """A rest, then hands lead a gliding mock-up round a circle while it turns to and fro."""
    imu, stars, truth = _log(_laboratory(warm_up_s=300.0), seed, REST_S, REST_S + FLIGHT_S)
    _write(folder, imu, stars, truth, REST_S, REST_S + FLIGHT_S)


def _laboratory(warm_up_s: float) -> dict[str, Any]:
    return {
        "table": {"tilt_rad": [0.0003, -0.0001], "waviness_rad": 2e-5},
        "vehicles": [
            {
                "name": "alpha",
                "start_m": [_CIRCLE_M, 0.0],
                "imu": {"position_body_m": list(LEVER_M), "clock_ppm": 0.0, "warm_up_s": warm_up_s},
                "camera": {
                    "source": "fixes", "rate_hz": 1.5, "delay_s": FIX_DELAY_S, "delay_jitter_s": 0.002,
                    "sigma_xy_m": FIX_SIGMA_M, "sigma_heading_rad": FIX_SIGMA_RAD, "wrong_fraction": 0.02,
                },
                "reference_rate_hz": 0.0,
            }
        ],
    }  # fmt: skip


Rows = list[tuple[float, ...]]


def _log(table: dict[str, Any], seed: int, rest_s: float, end_s: float) -> tuple[Rows, Rows, Rows]:
    """What reaches the host: packets and fixes, and where the mock-up was."""
    laboratory = EmulatedLaboratory(table, seed)
    vehicle = laboratory.mock_ups[0].vehicle
    frames, poses = FrameParser(2), PoseParser()
    imu: Rows = []
    stars: Rows = []
    truth: Rows = []
    ticks = _Ticks(laboratory.mock_ups[0].grid)
    for now_ns in range(0, round(end_s * NS), STEP_NS):
        now_s = now_ns / NS
        if now_s >= rest_s:
            vehicle.set_air(now_ns, True, 0.0)
            vehicle.set_hand(*_hand(vehicle.origin_at(now_ns), now_s - rest_s))
        here = vehicle.origin_at(now_ns)
        truth.append((now_s, here.x_m, here.y_m, here.heading_rad))
        for arrival in laboratory.advance(now_ns + STEP_NS - 1):
            _take(arrival, frames, poses, ticks, imu, stars)
    return imu, stars, truth


class _Ticks:
    """Ticks of a block that counts 16 bits, as seconds since the laboratory was switched on."""

    def __init__(self, grid: PollGrid) -> None:
        self._grid = grid
        self._last, self._turns = 0, 0

    def seconds(self, tick_ms: int) -> float:
        self._turns += tick_ms < self._last
        self._last = tick_ms
        return self._grid.stamp_ns(tick_ms + 65536 * self._turns) / NS


def _take(
    arrival: Arrival, frames: FrameParser, poses: PoseParser, ticks: _Ticks, imu: Rows, stars: Rows
) -> None:
    if not isinstance(arrival.data, bytes):
        return
    if arrival.channel.endswith("/imu"):
        for frame in frames.feed(arrival.data):
            if isinstance(frame, ImuFrame) and frame.tick_ms is not None:
                warmth_c = imu[-1][4] if imu else math.nan
                if frame.housekeeping is not None and frame.housekeeping.item == 0:
                    warmth_c = temperature_gyro_c(frame.housekeeping.value)
                force_m_s2 = map(specific_force_m_s2, frame.tilt_difference_counts)
                rate = rate_rad_s(frame.gyro_counts)
                imu.append((ticks.seconds(frame.tick_ms), rate, *force_m_s2, warmth_c))
    elif arrival.channel.endswith("/fixes"):
        for pose in poses.feed(arrival.data):
            exposure_s, arrival_s = pose.stamp_source_ns / NS, arrival.stamp_ns / NS
            stars.append((exposure_s, arrival_s, *pose.position_table_m, pose.heading_rad))


def _hand(here: Any, flown_s: float) -> tuple[float, float, float]:  # noqa: ANN401 - a Motion of the plant
    """Force (N) and torque (N m) of hands that lead the mock-up along its way like springs."""
    grow = min(1.0, flown_s / 5.0)
    angle = math.tau * max(0.0, flown_s - 2.0) / _CIRCLE_S
    aim_x, aim_y = _CIRCLE_M * math.cos(angle), _CIRCLE_M * math.sin(angle)
    aim_rad = _TURN_RAD_S * flown_s * grow + _SWAY_RAD * math.sin(math.tau * flown_s / _SWAY_S) * grow
    stiff, damp = (math.tau * _RATE_HZ) ** 2, 2.0 * _DAMPING * math.tau * _RATE_HZ
    return (
        _MASS_KG * (stiff * (aim_x - here.x_m) - damp * here.vx_m_s),
        _MASS_KG * (stiff * (aim_y - here.y_m) - damp * here.vy_m_s),
        _INERTIA_KG_M2 * (9.0 * stiff * (aim_rad - here.heading_rad) - 3.0 * damp * here.rate_rad_s),
    )


def _write(folder: Path, imu: Rows, stars: Rows, truth: Rows, rest_s: float, end_s: float) -> None:
    known = [row for row in imu if not math.isnan(row[4])]
    rows = [(f"{t:.6f}", f"{w:.8f}", f"{x:.7f}", f"{y:.7f}", f"{c:.3f}") for t, w, x, y, c in known]
    write_table(folder / "imu.csv", IMU_COLUMNS, rows)
    if stars:
        write_table(folder / "stars.csv", STAR_COLUMNS, [[f"{v:.7f}" for v in row] for row in stars])
        write_table(folder / "truth.csv", "t_s,x_m,y_m,heading_rad", [[f"{v:.7f}" for v in r] for r in truth])
    noise = noise_figures("published")
    keys = {
        "run_start_s": rest_s, "duration_s": end_s, "imu_rate_hz": 100.0, "poll_rate_hz": 1000.0,
        "imu_offset_m": list(LEVER_M), "imu_offset_sigma_m": 0.001, "mass_kg": _MASS_KG,
        "inertia_kg_m2": _INERTIA_KG_M2, "star_sigma_xy_m": FIX_SIGMA_M,
        "star_sigma_heading_rad": FIX_SIGMA_RAD, "star_delay_s": FIX_DELAY_S,
        "gyro_noise_poll_rad_s": noise.gyro_rms_rad_s, "acc_noise_poll_m_s2": noise.acc_rms_m_s2,
        "gyro_lsb_rad_s": math.radians(1.0 / 4.1), "acc_lsb_m_s2": 9.80665 / 6554.0,
        "gyro_tempco_rad_s_C": math.radians(0.02), "acc_tempco_m_s2_C": 3e-4,
        "gyro_bandwidth_hz": noise.gyro_bandwidth_hz, "acc_bandwidth_hz": noise.acc_bandwidth_hz,
    }  # fmt: skip
    write_json(folder / "meta.json", {"known": keys})
