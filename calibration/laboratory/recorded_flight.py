"""What a recording holds of one vehicle that tells of valves, sensors and camera, as arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from calibration.laboratory.coil_spans import CoilSpans, coil_spans
from calibration.laboratory.thrust_course import POLL_S, Windows
from calibration.outcome import CalibrationRefusedError
from groundstation.declarations.rig import Rig
from groundstation.parts.imu.messages import Imu, ImuBytes
from groundstation.parts.imu.sections import ImuOfType
from groundstation.parts.stars.messages import FixBytes, StarFix
from groundstation.parts.valves.messages import CanOut, ValveStatus
from groundstation.parts.valves.sections import ValvesOfRig, ValvesOfVehicle
from groundstation.recording.reader import Recording

Array = NDArray[np.float64]

BITRATE = 500_000.0
"""Of a valve bus whose rig states none (docs/interfaces/valve_bus.md)."""
LIFTED_S = 0.6
"""So long after the air is on the vehicle surely floats; a touch of the floor is no force of a valve."""
SHORTEST_S = 5.0
CLOCK_SMOOTHING_S = 10.0
LINK_LOOKED_AT_NS = 2_000_000_000
_ALL_USABLE = 7
_NS = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFlight:
    """One vehicle during its longest flight, times in polls of its IMU block since ``origin_ns``.

    Attributes:
        vehicle: Its name.
        windows: Averaging windows of the packets that were taken afloat.
        rate_rad_s: (n,) as measured.
        force_m_s2: (n, 2) as measured.
        stamp_ns: (n,) end of each window, host time, by the line through all stamps.
        link_sigma_s: What the IMU's link leaves unknown of all stamps alike.
        polls: Length of the course.
        coils: Of its valves.
        coil_start, coil_stop: (p,) their spans in polls.
        arrival_ns: (m,) when pictures of which the station made something, fix or not, arrived.
        fix_arrival_ns: (f,) when the picture of each fix arrived.
        fix_stamp_ns: (f,) exposure that the station believed in.
        fix_pose: (f, 3) x, y, heading.
    """

    vehicle: str
    windows: Windows
    rate_rad_s: Array
    force_m_s2: Array
    stamp_ns: Array
    link_sigma_s: float
    polls: int
    coils: CoilSpans
    coil_start: Array
    coil_stop: Array
    arrival_ns: NDArray[np.int64]
    fix_arrival_ns: NDArray[np.int64]
    fix_stamp_ns: NDArray[np.int64]
    fix_pose: Array

    @property
    def flown_s(self) -> float:
        """How long it was afloat."""
        return len(self.rate_rad_s) * self.windows.polls * POLL_S


def read_flight(recording: Recording, rig: Rig, vehicle: str, camera_delay_s: float | None) -> RecordedFlight:
    """Read one vehicle.

    Args:
        recording: The recording.
        rig: Of it.
        vehicle: Whose flight.
        camera_delay_s: What was taken off a picture's arrival for the stamp of its fix; None where poses came
            with ages of their own.

    Raises:
        CalibrationRefusedError: It did not fly, or nothing commanded its valves.
        RecordingError: The recording is damaged.
    """
    imu, afloat = _imu_of(recording, vehicle)
    bus = rig.section(ValvesOfRig).valve_bus
    bitrate = float(bus.get("bitrate", BITRATE)) if isinstance(bus, dict) else BITRATE
    frames = (
        (delivered.envelope.publish_ns, delivered.payload.arbitration_id, delivered.payload.data)
        for delivered in recording.delivered((CanOut,))
        if isinstance(delivered.payload, CanOut)
    )
    coils = coil_spans(frames, rig.vehicle(vehicle, ValvesOfVehicle).bus_index, bitrate)
    if not len(coils.valve):
        raise CalibrationRefusedError(f"no valve of {vehicle} was ever commanded to open")
    tick, sizes = imu[:, 1], imu[:, 2]
    size = int(np.median(sizes))
    stamp_ns, per_poll_ns = _clock(imu[:, 0], tick, imu[:, 3])
    start_ns, stop_ns = max(afloat, key=lambda span: min(span[1], stamp_ns[-1]) - span[0])
    inside = (stamp_ns > start_ns + LIFTED_S * 1e9) & (stamp_ns < stop_ns)
    inside &= (sizes == size) & np.isfinite(imu[:, 4:]).all(axis=1)
    if inside.sum() * size * POLL_S < SHORTEST_S:
        raise CalibrationRefusedError(
            f"{vehicle} floated for {inside.sum() * size * POLL_S:.1f} s; a flight of {SHORTEST_S:g} s and "
            "more is needed"
        )
    rows = np.flatnonzero(inside)
    # pulses may be under way when it lifts off: the course begins a second before
    first_tick = tick[rows[0]] - size - round(1.0 / POLL_S)
    origin_ns = stamp_ns[rows[0]] + (first_tick - tick[rows[0]]) * per_poll_ns
    last = (tick[rows] - first_tick).astype(np.intp)

    def in_polls(moment_ns: NDArray[np.int64]) -> Array:
        return np.asarray((moment_ns - origin_ns) / per_poll_ns, dtype=np.float64)

    arrival, fixes = _pictures_of(recording, vehicle, camera_delay_s)
    return RecordedFlight(
        vehicle=vehicle,
        windows=Windows(last, size),
        rate_rad_s=imu[rows, 4],
        force_m_s2=imu[rows, 5:7],
        stamp_ns=stamp_ns[rows],
        link_sigma_s=_link_sigma_s(recording, rig, vehicle, round(stamp_ns[rows[0]]), size * POLL_S),
        polls=int(last[-1]) + 1,
        coils=coils,
        coil_start=in_polls(coils.start_ns),
        coil_stop=in_polls(coils.stop_ns),
        arrival_ns=arrival,
        fix_arrival_ns=fixes[:, 0].astype(np.int64),
        fix_stamp_ns=fixes[:, 1].astype(np.int64),
        fix_pose=fixes[:, 2:],
    )


def _imu_of(recording: Recording, vehicle: str) -> tuple[Array, list[tuple[float, float]]]:
    """Return (n, 7) stamp, tick, polls, sigma, rate, forces of the block's longest run; when it floated."""
    rows: list[tuple[float, ...]] = []
    starts = [0]
    spans: list[list[float]] = []
    for message in recording.messages((Imu, ValveStatus), (vehicle,)):
        payload = message.payload
        if isinstance(payload, ValveStatus):
            if payload.floating and (not spans or spans[-1][1] < np.inf):
                spans.append([float(message.log_ns), np.inf])
            elif not payload.floating and spans and spans[-1][1] == np.inf:
                spans[-1][1] = float(message.log_ns)
            continue
        assert isinstance(payload, Imu)
        if rows and (payload.elapsed_ms == 0 or payload.tick_ms <= rows[-1][1]):
            starts.append(len(rows))
        usable = payload.valid and payload.usable == _ALL_USABLE
        values = (payload.rate_body_rad_s, *payload.force_body_m_s2) if usable else (np.nan,) * 3
        rows.append(
            (
                float(payload.stamp_ns),
                float(payload.tick_ms),
                round(payload.window_s / POLL_S),
                payload.stamp_sigma_s,
                *values,
            )
        )
    if not rows:
        raise CalibrationRefusedError(f"holds no IMU sample of {vehicle}")
    if not spans:
        raise CalibrationRefusedError(f"{vehicle} never floated: nothing was flown")
    table = np.array(rows)
    runs = np.split(table, starts[1:])
    return max(runs, key=len), [(start, stop) for start, stop in spans]


def _clock(stamp_ns: Array, tick: Array, sigma_s: Array) -> tuple[Array, float]:
    """Return each window's end by the line through all stamps, and the length of a poll, ns."""
    sure = sigma_s < 1.5 * sigma_s.min()
    slope, offset = np.polyfit(tick[sure] - tick[0], stamp_ns[sure] - stamp_ns[0], 1)
    line = slope * (tick - tick[0]) + offset
    off = np.interp(tick, tick[sure], (stamp_ns - stamp_ns[0] - line)[sure])
    size = max(1, round(CLOCK_SMOOTHING_S * 1e3 / float(np.median(np.diff(tick)))))
    return stamp_ns[0] + line + uniform_filter1d(off, size, mode="nearest"), float(slope)


def _link_sigma_s(recording: Recording, rig: Rig, vehicle: str, from_ns: int, period_s: float) -> float:
    """Return the sigma of how long the last byte of a read has waited in the adapter.

    The clock takes it for the timer less the packet; a timer that runs from the packet before lets it wait
    for less (docs/interfaces/imu_block.md, 1).
    """
    imu = rig.of_type(vehicle, ImuOfType).imu
    sizes: list[int] = []
    timer_s = imu.ftdi_latency_s
    for message in recording.messages((ImuBytes,), (vehicle,), from_ns, from_ns + LINK_LOOKED_AT_NS):
        payload = message.payload
        assert isinstance(payload, ImuBytes)
        sizes.append(len(payload.data))
        timer_s = payload.latency_timer_s if np.isfinite(payload.latency_timer_s) else timer_s
    if not sizes:
        return timer_s / math.sqrt(3.0)
    byte_s = 10.0 / imu.baud
    frame_bytes = sum(sizes) * period_s / (LINK_LOOKED_AT_NS * 1e-9)
    frames = max(1.0, float(np.median(sizes)) / frame_bytes)
    span_s = (frames - 1.0) * period_s + frame_bytes * byte_s
    pause_s = max(0.0, period_s - frame_bytes * byte_s)
    return min(max(0.0, timer_s - span_s), pause_s) / math.sqrt(3.0)


def _pictures_of(
    recording: Recording, vehicle: str, camera_delay_s: float | None
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return arrivals (m,) of pictures and (f, 5) arrival, stamp, x, y, heading of fixes."""
    arrivals: list[int] = []
    fixes: list[tuple[float, ...]] = []
    newest_ns = 0
    for message in recording.messages((StarFix, FixBytes), (vehicle,)):
        payload = message.payload
        if not isinstance(payload, StarFix):
            newest_ns = payload.stamp_ns
            continue
        arrival_ns = newest_ns if camera_delay_s is None else payload.stamp_ns + round(camera_delay_s * 1e9)
        arrivals.append(arrival_ns)
        if payload.fix:
            fixes.append((arrival_ns, payload.stamp_ns, payload.x_m, payload.y_m, payload.heading_rad))
    return np.array(arrivals, dtype=np.int64), np.array(fixes, dtype=np.float64).reshape(-1, 5)
