"""Whether a floating mock-up moves as its valves are commanded, and if not, which valve or what else it is.

`docs/fault_detection.md` derives the tests and states what they cannot see.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from operator import attrgetter

from groundstation.control.valve_health import ValveHealth
from groundstation.control.vehicle import VehicleModel
from groundstation.supervision.finding import Finding
from groundstation.supervision.thrust_blocks import Block, ThrustBlocks
from groundstation.supervision.thrust_fit import FitConfig, Misfit, ThrustFit
from groundstation.supervision.valve_hypotheses import Symptom, ValveSuspicions
from groundstation.supervision.valve_inquiry import SURE, ValveInquiry, Verdict
from groundstation.supervision.valve_trial import Kind

PUSHED_HOLDS_NS = 2_000_000_000
_LATE_COMMAND_BLOCKS = 10
"""So many are not judged after a moment at which a command was late on its way to the node."""
_DOUBTED = 3.0
"""A block is not learned from while a fault is that likely; a weak valve is what learning is to find out."""
_UNEXPLAINED_CHANCE = (0.01, 0.9)
"""Of a block that no valve explains: of a healthy flight, and of one that is being pushed."""
_OF_COMMANDED = 0.35
_OF_LARGEST = 0.3
_HARD_PUSH = 1.7
_CALM_BLOCKS = 10
_LONGEST_PUSH_BLOCKS = 50
"""After a shock valves are not accused while forces go on, but not for longer than this."""
_IS_CONSTANT = 0.95

LARGEST_STEP_M_S2 = 0.08
"""What a zero of the accelerometers can step by: 0.3 deg, the drift of the data sheet over the whole range of
temperatures, and half as much again. A hand pushes harder."""
_CARRIED_M = 1.0
"""What is larger was no hand once that hand would have carried the mock-up so far: it is a broken sensor."""

_evidence = attrgetter("evidence")
LEAST_PUSH_M_S = 0.3e-3
"""In a block; less than a valve gives is explained by a clock that is off, and harms nobody."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveConsistencyConfig:
    """What the tests need to know.

    Attributes:
        fit: What is known of valves and sensors.
        open_delay_s: From a command to thrust.
        close_delay_s: From the end of an on-time to none.
        rise_s: Time constant of the thrust.
        acc_lag_s: Of the accelerometers' low-pass, 0 for none.
        gyro_lag_s: Of the gyro's.
        block_s: What is weighed at a time.
        false_alarm_chance: Of any false alarm in `over_s` of flight.
        over_s: See there.
        wait_s: How long to wait for more evidence when two valves could explain it.
        shift_s: A force without torque that lasts as long is a shifted accelerometer, if it is no
            larger than its zero can step by.
    """

    fit: FitConfig
    open_delay_s: float = 0.006
    close_delay_s: float = 0.005
    rise_s: float = 0.004
    acc_lag_s: float = 0.0
    gyro_lag_s: float = 0.0
    block_s: float = 0.02
    false_alarm_chance: float = 0.01
    over_s: float = 36_000.0
    wait_s: float = 0.3
    shift_s: float = 0.8


class ValveConsistency:
    """Compares commands with IMU samples. Only to be fed while the vehicle floats.

    Args:
        model: Mass, inertia, valves.
        config: Delays, noise, wanted chance of a false alarm.

    Attributes:
        threshold: Evidence at which a fault is believed, in natural logarithms.
        health: What valves give that were named, by their numbers.
    """

    def __init__(self, model: VehicleModel, config: ValveConsistencyConfig) -> None:
        self._config = config
        self._blocks = ThrustBlocks(
            model,
            (config.open_delay_s, config.close_delay_s),
            config.rise_s,
            (config.acc_lag_s, config.gyro_lag_s),
            config.block_s,
        )
        self._fit = ThrustFit(model, config.fit)
        self._suspicions = ValveSuspicions(self._fit)
        tests = len(self._suspicions.cases) + 1
        self.threshold = math.log(tests * config.over_s / (config.block_s * config.false_alarm_chance))
        self._inquiry = ValveInquiry(self._fit, self.threshold, config.block_s, config.wait_s)
        self._largest = max(self._fit.sizes)
        self._valve_findings: tuple[Finding, ...] = ()
        self.health: Mapping[int, ValveHealth] = {}
        self._is_settled = False
        self._pushed: tuple[int, Finding] | None = None
        self._shifted: tuple[Finding, ...] = ()
        self._begin()

    def _begin(self) -> None:
        self._calm_after = self._pushed_blocks = self._blocks_to_skip = 0
        self._unexplained = 0.0
        self._inquiry.forget()
        self._odd_blocks, self._odd_x, self._odd_y, self._odd_square = 0, 0.0, 0.0, 0.0

    def start(self, zero_force_m_s2: tuple[float, float] = (0.0, 0.0)) -> None:
        """Begin to be fed: the vehicle floats. Findings stay, and what was learned of the valves.

        Args:
            zero_force_m_s2: Zero of the accelerometers as known now, body axes.
        """
        self._blocks.reset()
        self._fit.start(zero_force_m_s2)
        self._suspicions.drop()
        self._begin()

    def reset(self) -> None:
        """Forget findings, and what valves were found to give."""
        self._valve_findings = ()
        self.health = {}
        self._is_settled = False
        self._fit.forget_weak()
        self._shifted = ()
        self._pushed = None
        self._suspicions.drop()
        self._begin()

    def command(self, now_ns: int, pulse_id: int, on_time_ms: bytes | tuple[int, ...]) -> None:
        """Take every output of the guard at the moment it is sent; repeats of a pulse id change nothing."""
        self._blocks.command(now_ns, pulse_id, on_time_ms)

    def sample(
        self, stamp_ns: int, window_s: float, rate_rad_s: float, force_m_s2: tuple[float, float]
    ) -> bool:
        """Take an IMU sample that is believed; whether the findings may have changed.

        Args:
            stamp_ns: End of its averaging window.
            window_s: Length of the window.
            rate_rad_s: Turn rate, zero removed to some 0.01 rad/s.
            force_m_s2: Specific force x, y as measured, body axes; `start` was given its zero.
        """
        if not (math.isfinite(rate_rad_s) and all(map(math.isfinite, force_m_s2))):
            return False  # a hole in the samples; a sum with it would never be a number again
        block = self._blocks.sample(stamp_ns, window_s, rate_rad_s, force_m_s2)
        if block is None:
            return False
        before = self._valve_findings, self._shifted, self._pushed
        self._take(block, stamp_ns)
        return before != (self._valve_findings, self._shifted, self._pushed)

    def skip_late_command(self) -> None:
        """Judge nothing for a fifth of a second: what was commanded may have been carried out late."""
        self._blocks_to_skip = _LATE_COMMAND_BLOCKS

    def findings(self, now_ns: int) -> tuple[Finding, ...]:
        """What was found: valves and sensors until `reset`, pushes for two seconds."""
        found = self._valve_findings + self._shifted
        if self._pushed is not None and now_ns - self._pushed[0] < PUSHED_HOLDS_NS:
            found += (self._pushed[1],)
        return found

    def _take(self, block: Block, stamp_ns: int) -> None:
        misfit = self._fit.compare(block)
        if self._blocks_to_skip:
            self._blocks_to_skip -= 1
            self._fit.lose_rate()
            return
        x, y = misfit.force_m_s2
        size = math.hypot(x, y)
        sigma = math.sqrt(misfit.force_variance)
        odd = (
            size > 4.0 * sigma + _OF_COMMANDED * misfit.commanded_m_s2 and size > _OF_LARGEST * self._largest
        )
        if self._watch_odd(block, misfit, is_odd=odd):
            return  # what was compared with the zero of before teaches nothing
        broken = self._largest if self._valve_findings else 0.0  # what a valve that fails gives besides
        if size > _HARD_PUSH * self._largest + broken + misfit.commanded_m_s2 + 6.0 * sigma:
            self._push(stamp_ns, size * block.span_s, "a shock that no valve can give")
            return
        if self._calm_after:
            self._calm_after -= 1
            self._pushed_blocks += 1
            if odd and (self._pushed_blocks < _LONGEST_PUSH_BLOCKS or self._is_hand()):
                self._calm_after = max(self._calm_after, _CALM_BLOCKS // 2)
            self._fit.lose_rate()
            return
        if self._is_settled:
            return  # what a second fault would look like beside the first is not worked out
        spoke = self._suspicions.weigh(block, misfit)
        usual, pushed = _UNEXPLAINED_CHANCE
        chance = pushed / usual if odd and not spoke else (1.0 - pushed) / (1.0 - usual)
        self._unexplained = max(0.0, self._unexplained + math.log(chance))
        if self._unexplained > self.threshold:
            self._push(stamp_ns, size * block.span_s, "a force that no valve explains")
            return
        self._inquiry.take(block, misfit)
        worst = max(self._suspicions.cases, key=_evidence)
        if worst.evidence >= self.threshold:
            self._inquiry.alarm(self._suspicions.cases)
            self._suspicions.drop()
        verdict = self._inquiry.verdict()
        if verdict is not None:
            self._name(stamp_ns, verdict)
        elif not self._inquiry.is_open and worst.evidence < (
            SURE if worst.symptom is Symptom.WEAK else _DOUBTED
        ):
            self._fit.learn(block, misfit)

    def _name(self, stamp_ns: int, verdict: Verdict) -> None:
        """Believe it. What a weak or closed valve gives is taken for known, and the watch goes on."""
        best = verdict.best
        force_m_s2 = best.size * self._fit.sizes[best.valve] if best.valve >= 0 else 0.0
        may_be_zero = verdict.is_hand and force_m_s2 < self._config.fit.zero_bound_m_s2
        if verdict.is_hand and not may_be_zero:
            self._push(stamp_ns, force_m_s2 * self._config.block_s, "a force that is no valve's")
            return
        self._suspicions.drop()
        if best.kind is Kind.ZERO or may_be_zero:
            self._fit.doubt_zero()
            return
        if best.kind is Kind.WORKS:
            whose = verdict.whose
            self._fit.take_healthy(best.valve)
            self._valve_findings = tuple(each for each in self._valve_findings if each.whose != whose)
            self.health = {valve: health for valve, health in self.health.items() if valve != best.valve}
            return
        self._valve_findings += verdict.findings()
        self.health = {**self.health, **verdict.health()}
        if best.kind in (Kind.WEAK, Kind.CLOSED):
            self._fit.take_weak(best.valve, best.size)
        elif best.kind is Kind.OPEN:
            self._is_settled = True

    def _push(self, stamp_ns: int, change_m_s: float, what: str) -> None:
        detail = f"{what}: {1e3 * change_m_s:.1f} mm/s within {1e3 * self._config.block_s:.0f} ms"
        if change_m_s >= LEAST_PUSH_M_S:
            self._pushed = (stamp_ns, Finding("pushed", detail))
        self._suspicions.drop()
        self._inquiry.forget()
        self._unexplained = 0.0
        self._calm_after, self._pushed_blocks = _CALM_BLOCKS, 0
        self._fit.lose_rate()

    def _watch_odd(self, block: Block, misfit: Misfit, *, is_odd: bool) -> bool:
        """A force that stays, is no valve's and is the same in every block: the sensor's. True if found."""
        if not is_odd:
            self._odd_blocks, self._odd_x, self._odd_y, self._odd_square = 0, 0.0, 0.0, 0.0
            return False
        x, y = misfit.force_m_s2
        self._odd_blocks += 1
        self._odd_x, self._odd_y = self._odd_x + x, self._odd_y + y
        self._odd_square += x * x + y * y
        lasted_s = self._odd_blocks * block.span_s
        if lasted_s < self._config.shift_s or self._shifted or self._valve_findings:
            return False
        mean, is_constant = self._odd_force()
        size = math.hypot(*mean)
        if not is_constant or (size > LARGEST_STEP_M_S2 and 0.5 * size * lasted_s**2 < _CARRIED_M):
            return False
        detail = (
            f"accelerometers read ({1e3 * mean[0]:.0f}, {1e3 * mean[1]:.0f}) mm/s^2 that no valve explains: "
            "their zero moved, or a steady push"
        )
        self._shifted = (Finding("imu_shifted", detail),)
        self._fit.shift_zero(mean)
        self._suspicions.drop()
        self._inquiry.forget()
        return True

    def _odd_force(self) -> tuple[tuple[float, float], bool]:
        """Mean of the force that no valve explains, since it began, and whether it stayed the same."""
        count, x, y = self._odd_blocks, self._odd_x, self._odd_y
        return (x / count, y / count), x * x + y * y >= _IS_CONSTANT * count * self._odd_square

    def _is_hand(self) -> bool:
        """Whether a force goes on that is the same all the time, and larger than a zero's step."""
        mean, is_constant = self._odd_force()
        return is_constant and math.hypot(*mean) > LARGEST_STEP_M_S2
