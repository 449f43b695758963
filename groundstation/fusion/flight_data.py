"""One flight as arrays, and an estimator fed with it in the order in which things arrived."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.estimator import Estimator, Fix, FixOutcome, ImuPacket, PlanarState
from groundstation.fusion.fix_repeats import REPEATS, repeated_fixes
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.stamp_screen import LARGEST_S, Screened, repeated_rows, screen_stamps, set_back_at
from groundstation.fusion.stamp_ticks import StampTicks

Array = NDArray[np.float64]

NS = 1e9
PROGRESS_PACKETS = 20000
PAUSE_S = 60.0
"""Nobody watched for longer than that: a rest is over, and another one may follow."""
REFERENCE_COLUMNS = 7
FIX_ROWS = 5
"""Before and after, by which it is judged whether the fixes' clock was set back, too."""
START_S, START_SHARE = 1.0, 0.1
"""A clock that falls back to this much after its begin, and of its run, is begun anew."""
UNKNOWN_S = 2.0 * PAUSE_S
"""What is counted for the time before a clock that began anew, as nobody knows it."""
EARLY_S = 1e-3
"""So much earlier than its exposure a fix may arrive: rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class FlightData:
    """Packets, fixes and what is known of them; seconds of one clock.

    Attributes:
        imu: (n, 5) stamp s, rate, ax, ay, temperature, in the order of arrival; once screened the stamp is
            NaN where it was set aside, and counted on where the clock was set back.
        stars: (m, 5) exposure s, arrival s, x, y, heading, in the order of arrival.
        covariance: (m, 3, 3) of each fix.
        run_start_s: Until then the vehicle stands still.
        noise: Of sensors and fixes.
        reference: (k, 7) s, x, y, heading, velocity x, y, turn rate by motion capture or an emulator; for
            judging results only.
        stamp_delay_s: What was taken off the arrivals to give the exposures.
        given_s: (n,) the stamps as they were given; None before the screen.
        odd: How many packets were set aside, by reason, and how often the clock was set back.
        notes: What was set aside, a sentence each.
    """

    imu: Array
    stars: Array
    covariance: Array
    run_start_s: float
    noise: NoiseModel
    reference: Array = field(default_factory=lambda: np.empty((0, REFERENCE_COLUMNS)))
    stamp_delay_s: float = 0.0
    given_s: Array | None = None
    odd: Mapping[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def at_rest(self) -> Array:
        """Return the packets (r, 5) of the rest at the start."""
        return self.imu[self.imu[:, 0] <= self.run_start_s]

    def screened(self, name: Callable[[Screened], tuple[str, ...]] = lambda _: ()) -> FlightData:
        """Return the same with the packets' stamps judged; fixes follow a clock that was set back.

        Args:
            name: Puts into words what was set aside.
        """
        if self.given_s is not None:
            return self
        found = _parted(
            screen_stamps(self.imu[:, 0], self.noise.packet_period_s, repeated_rows(self.imu)),
            self.imu[:, 0],
            self.stars,
        )
        imu = self.imu.copy()
        imu[:, 0] = found.stamp_s
        odd = {reason: len(rows) for reason, rows in found.aside.items()}
        if found.set_back:
            odd["clock_jumped_back"] = len(found.set_back)
        stars = _with_the_clock(self.stars, found, self.imu[:, 0])
        notes = (*self.notes, *name(found))
        return replace(self, imu=imu, stars=stars, given_s=self.imu[:, 0], odd=odd, notes=notes)

    def tidied(self) -> FlightData:
        """Return the same with packets of rising stamps only, and each finite fix once, as it came first."""
        flight = self.screened()
        imu = flight.imu[np.isfinite(flight.imu[:, 0])]
        order = np.argsort(flight.stars[:, 1], kind="stable")
        stars, covariance = flight.stars[order], flight.covariance[order]
        once = np.isfinite(stars).all(axis=1) & ~repeated_fixes(stars, self.noise)
        notes = flight.notes
        if len(stars) > once.sum():
            notes = (
                *notes,
                f"{len(stars) - once.sum()} fixes that came twice or are no numbers were left out",
            )
        return replace(
            flight, imu=imu, stars=stars[once], covariance=covariance[once], given_s=imu[:, 0], notes=notes
        )


def _parted(found: Screened, given_s: Array, stars: Array) -> Screened:
    """Return the stamps with a pause before each start of the clock, where the fixes' clock began anew, too.

    A clock that falls back to its beginning is that of another session: nobody knows what went on between.
    If the fixes ran on, so did the flight.
    """
    if not found.set_back or _ran_on(stars, max(given_s[row] + back_s for row, back_s in found.set_back)):
        return found
    begun_s = float(given_s[np.isfinite(found.stamp_s)][0])
    stamp_s, starts = found.stamp_s.copy(), []
    for row, back_s in found.set_back:
        ran_s, fell_to_s = given_s[row] + back_s - begun_s, given_s[row] - begun_s
        if fell_to_s < START_S + START_SHARE * ran_s:
            stamp_s[row:] += UNKNOWN_S
            starts.append(row)
    return replace(found, stamp_s=stamp_s, starts=tuple(starts))


def _ran_on(stars: Array, newest_s: float) -> bool:
    """Whether fixes, in the order of their file, go on where the packets' clock began anew."""
    return len(set_back_at(stars[:, 1], FIX_ROWS)) == 0 and bool((stars[:, 1] > newest_s).any())


def _with_the_clock(stars: Array, found: Screened, given_s: Array) -> Array:
    """Return the fixes, in the order of their file, on the packets' clock; theirs may be set back as well."""
    if len(stars) == 0 or not found.set_back:
        return stars
    rows = set_back_at(stars[:, 1], FIX_ROWS)
    if len(rows) != len(found.set_back):
        return stars  # theirs ran on, and so does the packets' now
    stars = stars.copy()
    for row, (packet, _) in zip(rows, found.set_back, strict=True):
        after = np.flatnonzero(np.isfinite(found.stamp_s[packet:]))[0] + packet
        shift = found.stamp_s[after] - given_s[after]
        stop = next((later for later in rows if later > row), len(stars))
        stars[row:stop, :2] += shift
    return stars


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
    data = data.screened()
    for name, count in data.odd.items():
        estimator.counters.add(name, count)
    ticks = StampTicks(data.noise.packet_period_s)
    order = np.argsort(data.stars[:, 1], kind="stable")  # a stamp that is no number comes last
    is_again = repeated_fixes(data.stars[order], data.noise).tolist()
    stars, covariance, next_fix = data.stars[order].tolist(), data.covariance[order], 0
    accounts: list[FixOutcome] = []
    states: list[PlanarState | None] = []
    resting = data.run_start_s > 0.0
    rows = data.imu.tolist()
    before_s = next((row[0] for row in rows if row[0] == row[0]), 0.0) - data.noise.packet_period_s
    if resting:
        estimator.begin_rest(round(min(0.0, before_s) * NS))
    for number, (t, rate, ax, ay, temperature) in enumerate(rows):
        if t != t:  # set aside: nothing is done at a moment that is not known
            states.append(None)
            continue
        while next_fix < len(stars) and stars[next_fix][1] <= t:
            if is_again[next_fix]:
                estimator.counters.add("fix_" + REPEATS.replace(" ", "_"))
                accounts.append(_refused(stars[next_fix], REPEATS))
            else:
                accounts.append(_add_fix(estimator, stars[next_fix], covariance[next_fix]))
            next_fix += 1
        if resting and t > data.run_start_s:
            estimator.end_rest(round(max(before_s, data.run_start_s) * NS))
            resting = False
        elif resting and t - before_s > PAUSE_S:
            estimator.end_rest(round(before_s * NS))
            estimator.begin_rest(round(t * NS))
        before_s = t
        packet = ImuPacket(round(t * NS), ticks.elapsed_s(t), rate, ax, ay, temperature)
        states.append(estimator.add_imu(packet))
        if progress is not None and number % PROGRESS_PACKETS == PROGRESS_PACKETS - 1:
            progress(number / len(rows))
    for row in stars[next_fix:]:
        estimator.counters.add("fix_after_the_last_packet")
        accounts.append(_refused(row, "arrived after the last packet"))
    return states, _merge(accounts, estimator.settled())


def lost_spans(data: FlightData, states: list[PlanarState | None]) -> list[tuple[float, float]]:
    """Return between which moments, s as the packets' file gives them, an estimator called itself lost."""
    spans: list[tuple[float, float]] = []
    was_lost = False
    given_s = data.imu[:, 0] if data.given_s is None else data.given_s
    for t, state in zip(given_s.tolist(), states, strict=True):
        if state is None:
            continue
        if state.is_lost:
            spans = [*spans[:-1], (spans[-1][0], t)] if was_lost else [*spans, (t, t)]
        was_lost = state.is_lost
    return spans


def _add_fix(estimator: Estimator, row: list[float], covariance: Array) -> FixOutcome:
    exposure, arrival, x, y, heading = row
    if not abs(exposure) < LARGEST_S:
        estimator.counters.add("fix_stamp_not_finite")
        return _refused(
            [0.0, *row[1:]], "not finite" if exposure - exposure != 0.0 else "no moment of any clock"
        )
    if arrival < exposure - EARLY_S:
        estimator.counters.add("fix_arrives_before_its_exposure")
        return _refused(row, "arrives before its exposure")
    return estimator.add_fix(Fix(round(exposure * NS), round(arrival * NS), x, y, heading, covariance))


def _refused(row: list[float], reason: str) -> FixOutcome:
    stamp = round(row[0] * NS) if abs(row[0]) < LARGEST_S else 0
    return FixOutcome(stamp, False, reason, math.nan, math.nan, math.nan, math.nan)


def _merge(accounts: list[FixOutcome], settled: list[FixOutcome]) -> list[FixOutcome]:
    """Replace the account of a fix that waited by the one given when it was settled."""
    later = {account.t_exposure_ns: account for account in settled}
    return [
        later.pop(account.t_exposure_ns, account) if account.reason.startswith("waits") else account
        for account in accounts
    ]
