"""Whether gyro, accelerometers and fixes agree with each other: shifted zeros, bursts of wrong fixes.

`docs/fault_detection.md` derives the tests. Three sums of log-likelihood ratios, each never below 0: of
refused fixes, of the normalised innovations of used ones, and of what the gyro says between two fixes against
the turn of their headings.
"""

import math
from dataclasses import dataclass, field

from groundstation.frames import wrap_angle
from groundstation.supervision.finding import Finding
from groundstation.supervision.heading_lean import Heading

OUTSIDE = "outside the gate"
RESTARTED = "starts the estimate again"


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuConsistencyConfig:
    """What is usual, and what is to be found.

    Attributes:
        gyro_density_rad_s_rthz: White noise of the rate.
        heading_sigma_rad: Of a fix, what calibration leaves included.
        stamp_sigma_s: Of a fix's exposure against the samples.
        scale_sigma: Of the gyro's scale.
        zero_sigma_rad_s: Of the gyro's zero as the estimator knows it.
        zero_step_rad_s: Smallest step of it to be found.
        usual_refusals: Share of wrong fixes that is no burst.
        burst_refusals: Share of wrong fixes in a burst.
        innovation_factor: Of the covariance of the innovations, where the filter is wrong.
        gate_nis: Beyond it a fix is refused: innovations of used fixes end there.
        zero_drift_rad_s: Farthest an estimated zero of the gyro goes in `drift_s`.
        drift_s: See there.
        false_alarm_chance: Of any false alarm in `fixes` fixes: 0.01 in 10 h at 15 Hz.
        fixes: See there.
    """

    gyro_density_rad_s_rthz: float
    heading_sigma_rad: float
    stamp_sigma_s: float = 1e-3
    scale_sigma: float = 5e-3
    zero_sigma_rad_s: float = 5e-4
    zero_step_rad_s: float = 5e-3
    usual_refusals: float = 0.05
    burst_refusals: float = 0.6
    innovation_factor: float = 3.0
    gate_nis: float = 25.0
    zero_drift_rad_s: float = 5e-3
    drift_s: float = 5.0
    false_alarm_chance: float = 0.01
    fixes: float = 540_000.0


_BELIEVED_SIGMAS = 3.0
"""One fix proves nothing, however far off: it may be wrong."""
SPIN_RAD_S, SPUN_NS = 0.6, 20_000_000_000
"""In a faster spin scale and zero cannot be told apart, nor before the estimate has unlearned it."""
_LONGEST_GAP_S = 2.0
_LARGEST_STEP_RAD_S = 0.2
"""A turn that a larger step would take is a wrong fix; after three of them in a row the one before was."""
_WRONG_IN_A_ROW = 3
_KEPT = 8
_COHERENT = 0.7


@dataclass(slots=True)
class _Source:
    """Sums of one source of fixes."""

    refused: float = 0.0
    run: int = 0
    scatter: float = 0.0
    innovations: list[tuple[float, float, float]] = field(default_factory=list)


class ImuConsistency:
    """Fed with samples, fixes, accounts of fixes and estimated zeros of one vehicle while it floats.

    Args:
        config: See there.

    Attributes:
        threshold: Of each sum, in natural logarithms.
    """

    def __init__(self, config: ImuConsistencyConfig) -> None:
        self._config = config
        self.threshold = math.log(4.0 * config.fixes / config.false_alarm_chance)
        usual, burst = config.usual_refusals, config.burst_refusals
        self._refused_adds = math.log(burst / usual)
        self._used_adds = math.log((1.0 - burst) / (1.0 - usual))
        self.reset()

    def reset(self) -> None:
        """Forget findings and everything seen."""
        self._sources: dict[str, _Source] = {}
        self._found: dict[str, Finding] = {}
        self._turned_rad = 0.0
        self._turns: list[tuple[int, float]] = []  # stamp, turn since the start by the gyro
        self._headings: dict[str, Heading] = {}
        self._zeros: list[tuple[int, float]] = []
        self._spun_ns: int | None = None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was found, until `reset`."""
        return tuple(self._found.values())

    def sample(self, stamp_ns: int, rate_rad_s: float) -> None:
        """Take an IMU sample that is believed.

        Args:
            stamp_ns: End of its window.
            rate_rad_s: Rate, the estimator's zero removed.
        """
        if abs(rate_rad_s) > SPIN_RAD_S:
            self._spun_ns = stamp_ns
        if self._turns:
            span_s = (stamp_ns - self._turns[-1][0]) * 1e-9
            if not 0.0 < span_s < 0.1:
                self._turns.clear()  # what turned the vehicle meanwhile is not known
                self._headings.clear()
            else:
                self._turned_rad += rate_rad_s * span_s
        self._turns.append((stamp_ns, self._turned_rad))
        if stamp_ns - self._turns[0][0] > 2e9 * _LONGEST_GAP_S:
            del self._turns[: len(self._turns) // 2]

    def fix(self, source: str, stamp_ns: int, heading_rad: float, stamp_sigma_s: float = 0.0) -> None:
        """Take a fix that has a pose, believed or not.

        Args:
            source: Whose.
            stamp_ns: Its exposure.
            heading_rad: As it states.
            stamp_sigma_s: Of its exposure, as it states; what `config` states adds to it.
        """
        turned = self._turned_at(stamp_ns)
        if turned is None or self._spins(stamp_ns):
            self._headings.pop(source, None)
            return
        heading = self._headings.get(source)
        if heading is None or not 0.0 < (span_s := (stamp_ns - heading.stamp_ns) * 1e-9) < _LONGEST_GAP_S:
            self._headings[source] = Heading(stamp_ns, turned, heading_rad - turned, math.inf)
            return
        config = self._config
        by_gyro = turned - heading.turned_rad
        stamp_variance_s2 = config.stamp_sigma_s**2 + stamp_sigma_s**2
        noise = config.heading_sigma_rad**2 + stamp_variance_s2 * (by_gyro / span_s) ** 2
        if math.isinf(heading.variance):
            heading.variance = noise
        prior = (
            heading.variance
            + config.gyro_density_rad_s_rthz**2 * span_s
            + (config.zero_sigma_rad_s * span_s) ** 2
            + (config.scale_sigma * by_gyro) ** 2
        )
        total = prior + noise
        gap = wrap_angle(heading_rad - turned - heading.offset_rad)
        if abs(gap) > _LARGEST_STEP_RAD_S * span_s + 5.0 * math.sqrt(total):
            heading.wrong_in_a_row += 1
            if heading.wrong_in_a_row >= _WRONG_IN_A_ROW:
                del self._headings[source]
            return
        gain = prior / total
        bound = _BELIEVED_SIGMAS * math.sqrt(total)
        gap = min(max(gap, -bound), bound)
        heading.stamp_ns, heading.turned_rad, heading.wrong_in_a_row = stamp_ns, turned, 0
        heading.offset_rad += gain * gap
        heading.variance = (1.0 - gain) * prior
        for lean, sign in zip(heading.leans, (1.0, -1.0), strict=True):
            lean.add(gap, sign * config.zero_step_rad_s * span_s, total, gain)
            if lean.evidence > self.threshold:
                off = "more" if sign > 0.0 else "less"
                least = math.degrees(config.zero_step_rad_s / 2.0)
                self._find(
                    "imu_shifted",
                    f"fixes turn by {least:.2f} deg/s {off} than the gyro says, or farther: its zero moved",
                )

    def account(
        self, source: str, *, used: bool, reason: str, innovation: tuple[float, float, float], nis: float
    ) -> None:
        """Take what became of a fix.

        Args:
            source: Whose.
            used: Whether the estimator believed it.
            reason: Why not, as the estimator states it.
            innovation: x, y in m, heading in rad; NaN where there is none.
            nis: Normalised innovation squared, NaN where there is none.
        """
        sums = self._sources.setdefault(source, _Source())
        if used and reason == RESTARTED:
            # of a filter that expects too little it is no wonder, and no witness against the fixes
            fault = "filter_inconsistent" if "filter_inconsistent" in self._found else "wrong_fixes"
            self._explain(fault, source, sums, "the estimate had to begin again")
            return
        if used:
            sums.run = 0
            sums.refused = max(0.0, sums.refused + self._used_adds)
            if math.isfinite(nis):
                factor = self._config.innovation_factor
                bounded = min(nis, self._config.gate_nis)
                added = 0.5 * bounded * (1.0 - 1.0 / factor) - 1.5 * math.log(factor)
                sums.scatter = max(0.0, sums.scatter + added)
                self._keep(sums, innovation)
        elif reason == OUTSIDE:
            sums.run += 1
            sums.refused += self._refused_adds
            self._keep(sums, innovation)
        if sums.refused > self.threshold:
            self._explain("wrong_fixes", source, sums, f"{sums.run} fixes in a row refused")
        elif sums.scatter > self.threshold:
            # used, and leaning: an unmapped table does that, and nothing is wrong that landing would mend
            self._explain("filter_inconsistent", source, sums, "innovations beyond their covariance")

    def zero(self, now_ns: int, rate_rad_s: float) -> None:
        """Take the zero of the gyro that the estimator subtracts.

        Waves of the table move what it takes for those of the accelerometers: they are not judged here. Nor
        is the gyro's after a spin, whose scale it has learned for a zero.

        Args:
            now_ns: When it stated it.
            rate_rad_s: The zero.
        """
        config = self._config
        if self._spins(now_ns):
            self._zeros.clear()
        self._zeros.append((now_ns, rate_rad_s))
        while now_ns - self._zeros[0][0] > config.drift_s * 1e9:
            self._zeros.pop(0)
        turned = abs(rate_rad_s - self._zeros[0][1])
        if turned > config.zero_drift_rad_s:
            self._find("imu_shifted", f"the gyro's zero moved by {math.degrees(turned):.2f} deg/s")

    def _spins(self, now_ns: int) -> bool:
        return self._spun_ns is not None and now_ns - self._spun_ns < SPUN_NS

    def _turned_at(self, stamp_ns: int) -> float | None:
        """Turn by the gyro up to a moment; None where samples do not reach."""
        turns = self._turns
        if not turns or not turns[0][0] <= stamp_ns <= turns[-1][0]:
            return None
        low, high = 0, len(turns) - 1
        while low < high:
            middle = (low + high) // 2
            if turns[middle][0] < stamp_ns:
                low = middle + 1
            else:
                high = middle
        after = turns[low]
        if low == 0:
            return after[1]
        before = turns[low - 1]
        share = (stamp_ns - before[0]) / (after[0] - before[0])
        return before[1] + share * (after[1] - before[1])

    def _leans(self, source: str) -> bool:
        heading = self._headings.get(source)
        return heading is not None and any(lean.evidence > 0.5 * self.threshold for lean in heading.leans)

    @staticmethod
    def _keep(sums: _Source, innovation: tuple[float, float, float]) -> None:
        if all(map(math.isfinite, innovation)):
            sums.innovations = [*sums.innovations[1 - _KEPT :], innovation]

    def _explain(self, fault: str, source: str, sums: _Source, what: str) -> None:
        """Fixes that all lie to one side speak against the estimate, others against the fixes."""
        kept = sums.innovations
        x, y = sum(each[0] for each in kept), sum(each[1] for each in kept)
        square = len(kept) * sum(each[0] ** 2 + each[1] ** 2 for each in kept)
        leaning = square > 0.0 and x * x + y * y > _COHERENT * square
        sums.refused = sums.scatter = 0.0
        if self._leans(source):
            self._find("imu_shifted", f"{what}, and headings lean: the gyro's zero moved")
        elif leaning:
            mean = 1e3 * math.hypot(x, y) / len(kept)
            detail = (
                f"{source}: {what}, all {mean:.0f} mm to one side: the IMU shifted, or all fixes are wrong"
            )
            self._find(fault, detail)
        else:
            self._find(fault, f"{source}: {what}")

    def _find(self, fault: str, detail: str) -> None:
        self._found.setdefault(fault, Finding(fault, detail))
