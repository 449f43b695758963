"""One flight as arrays, and an estimator fed with it in the order in which things arrived."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.estimator import Estimator, Fix, FixOutcome, ImuPacket, PlanarState
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.stamp_ticks import StampTicks

Array = NDArray[np.float64]

NS = 1e9
PROGRESS_PACKETS = 20000


@dataclass(frozen=True, slots=True, eq=False)
class FlightData:
    """Packets, fixes and what is known of them; seconds of one clock.

    Attributes:
        imu: (n, 5) stamp s, rate, ax, ay, temperature, in the order of arrival.
        stars: (m, 5) exposure s, arrival s, x, y, heading, in the order of arrival.
        covariance: (m, 3, 3) of each fix.
        run_start_s: Until then the vehicle stands still.
        noise: Of sensors and fixes.
        reference: (k, 4) s, x, y, heading by motion capture or an emulator; for judging results only.
        stamp_delay_s: What was taken off the arrivals to give the exposures.
    """

    imu: Array
    stars: Array
    covariance: Array
    run_start_s: float
    noise: NoiseModel
    reference: Array = field(default_factory=lambda: np.empty((0, 4)))
    stamp_delay_s: float = 0.0

    def at_rest(self) -> Array:
        """Return the packets (r, 5) of the rest at the start."""
        return self.imu[self.imu[:, 0] <= self.run_start_s]

    def tidied(self) -> FlightData:
        """Return the same with packets of finite, rising stamps only, and fixes by arrival."""
        imu = self.imu[np.isfinite(self.imu[:, 0])]
        rising = imu[:, 0] > np.maximum.accumulate(np.concatenate([[-np.inf], imu[:-1, 0]]))
        order = np.argsort(self.stars[:, 1], kind="stable")
        return replace(self, imu=imu[rising], stars=self.stars[order], covariance=self.covariance[order])


def estimate(
    data: FlightData, estimator: Estimator, progress: Callable[[float], None] | None = None
) -> tuple[list[PlanarState | None], list[FixOutcome]]:
    """Feed a flight to an estimator in the order in which it arrived.

    Args:
        data: The flight.
        estimator: Fresh.
        progress: Is given the share that is done, now and then.

    Returns:
        A state (or None) for each packet, and the account of every fix in order of arrival.
    """
    ticks = StampTicks(data.noise.packet_period_s)
    stars, next_fix = data.stars.tolist(), 0
    accounts: list[FixOutcome] = []
    states: list[PlanarState | None] = []
    resting = data.run_start_s > 0.0
    if resting:
        estimator.begin_rest(0)
    rows = data.imu.tolist()
    for number, (t, rate, ax, ay, temperature) in enumerate(rows):
        while next_fix < len(stars) and stars[next_fix][1] <= t:
            accounts.append(_add_fix(estimator, stars[next_fix], data.covariance[next_fix]))
            next_fix += 1
        if resting and t > data.run_start_s:
            estimator.end_rest(round(data.run_start_s * NS))
            resting = False
        if t - t != 0.0:
            estimator.counters.add("packet_stamp_not_finite")
            states.append(None)
            continue
        packet = ImuPacket(round(t * NS), ticks.elapsed_s(t), rate, ax, ay, temperature)
        states.append(estimator.add_imu(packet))
        if progress is not None and number % PROGRESS_PACKETS == PROGRESS_PACKETS - 1:
            progress(number / len(rows))
    for row in stars[next_fix:]:
        estimator.counters.add("fix_after_the_last_packet")
        accounts.append(_refused(row, "arrived after the last packet"))
    return states, _merge(accounts, estimator.settled())


def _add_fix(estimator: Estimator, row: list[float], covariance: Array) -> FixOutcome:
    exposure, arrival, x, y, heading = row
    if exposure - exposure != 0.0:
        estimator.counters.add("fix_stamp_not_finite")
        return _refused([0.0, *row[1:]], "not finite")
    return estimator.add_fix(Fix(round(exposure * NS), round(arrival * NS), x, y, heading, covariance))


def _refused(row: list[float], reason: str) -> FixOutcome:
    stamp = round(row[0] * NS) if math.isfinite(row[0]) else 0
    return FixOutcome(stamp, False, reason, math.nan, math.nan, math.nan, math.nan)


def _merge(accounts: list[FixOutcome], settled: list[FixOutcome]) -> list[FixOutcome]:
    """Replace the account of a fix that waited by the one given when it was settled."""
    later = {account.t_exposure_ns: account for account in settled}
    return [
        later.pop(account.t_exposure_ns, account) if account.reason.startswith("waits") else account
        for account in accounts
    ]
