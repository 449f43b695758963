"""Fusion: IMU samples and late star fixes in, vehicle state out."""

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from groundstation.declarations.fix import Floor, PoseFix
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.frames import wrap_angle
from groundstation.fusion.estimator import WAITS, Estimator, Fix, FixOutcome, ImuPacket, PlanarState
from groundstation.fusion.first_fixes import CANDIDATE, CANDIDATE_AGE_S
from groundstation.fusion.fix_repeats import REPEATS, FixRepeats
from groundstation.fusion.rest_clock import RestChange, RestClock
from groundstation.parts.fusion.force_stand_in import ForceStandIn
from groundstation.parts.fusion.messages import FixAccount, FusionCalibration, FusionStatus, VehicleState
from groundstation.parts.imu.messages import USABLE_RATE, Imu
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveCommand, ValveStatus

STATUS_PERIOD_NS = 200_000_000
ORDER_HOLDS_NS = 1_000_000_000  # after an order to float, older status frames may still say "landed"
DIAGNOSTICS_EVERY = 5
LONGEST_WAIT_NS = 1_000_000_000
LONGEST_ALONE_NS = round(1.2 * CANDIDATE_AGE_S * 1e9)
NO_PACKETS = "no packets come"
NO_FILES: Mapping[str, tuple[str, str]] = MappingProxyType({})


class Fusion(Node):
    """Feeds an estimator and tells it when the vehicle rests: landed, and its IMU shows it.

    Args:
        vehicle: Its name.
        estimator: A fresh one.
        method: Its row in the table of estimators.
        payloads: Class of the fixes of each source that is taken, by the source's name.
        floors: What calibration leaves in every fix of each source, beyond its own covariance.
        rest: Decides whether a landed vehicle rests.
        calibration: The files that the estimator was made from, by name: hash and text.
        stand_in: For accelerometers that are not believed; without one such samples are a hole.
    """

    inputs: tuple[type[Message], ...] = (Imu, PoseFix, ValveStatus, ValveCommand, Supervision)
    outputs = (VehicleState, FixAccount, FusionStatus, FusionCalibration, Diagnostics)

    def __init__(
        self,
        vehicle: str,
        estimator: Estimator,
        method: str,
        payloads: Mapping[str, type[PoseFix]],
        floors: Mapping[str, Floor],
        rest: RestClock,
        calibration: Mapping[str, tuple[str, str]] = NO_FILES,
        stand_in: ForceStandIn | None = None,
    ) -> None:
        super().__init__(vehicle, STATUS_PERIOD_NS)
        self.inputs = (Imu, *payloads.values(), ValveStatus, ValveCommand, Supervision)
        self._sources = {payload: name for name, payload in payloads.items()}
        self._estimator = estimator
        self._method = method
        self._calibration = calibration
        self._stand_in = stand_in
        self._floors = {
            source: np.diag([xy_m**2, xy_m**2, heading_rad**2])
            for source, (xy_m, heading_rad) in floors.items()
        }
        self._repeats = FixRepeats()
        self._skipped_ms = 0
        self._rest = rest
        self._float_ordered_ns = -ORDER_HOLDS_NS
        self._is_air_ordered = False
        self._state: PlanarState | None = None
        self._fix_stamp_ns = 0
        self._used = self._refused = self._ticks = 0
        self._waiting: dict[tuple[int, str], tuple[int, FixOutcome]] = {}

    def start(self, now_ns: int) -> Iterator[Message]:
        if self._calibration:
            hashes, texts = zip(*self._calibration.values(), strict=True)
            yield FusionCalibration(now_ns, self.vehicle, tuple(self._calibration), hashes, texts)

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case Imu():
                yield from self._propagate(message)
                self._follow_rest(
                    self._rest.sample(
                        message.stamp_ns,
                        message.elapsed_ms * 1e-3,
                        (message.rate_body_rad_s, *message.force_body_m_s2),
                        now_ns,
                        is_valid=message.valid,
                    )
                )
            case PoseFix(fix=True):
                yield from self._correct(message, self._sources[type(message)], now_ns)
            case ValveStatus():
                if message.floating or now_ns - self._float_ordered_ns >= ORDER_HOLDS_NS:
                    self._receive_float(now_ns, floating=message.floating)
            case ValveCommand() if self._stand_in is not None:
                self._stand_in.receive(message, now_ns)
            case Supervision():
                if message.air_on and not self._is_air_ordered:
                    self._float_ordered_ns = now_ns
                    self._receive_float(now_ns, floating=True)
                self._is_air_ordered = message.air_on

    def tick(self, now_ns: int) -> Iterator[Message]:
        self._follow_rest(self._rest.check(now_ns))
        yield from self._overdue(now_ns)
        state = self._state
        age_s = (now_ns - self._fix_stamp_ns) * 1e-9 if self._fix_stamp_ns else math.inf
        biases = (
            (0.0, 0.0, 0.0)
            if state is None
            else (state.bias_rate_rad_s, state.bias_ax_m_s2, state.bias_ay_m_s2)
        )
        yield FusionStatus(
            now_ns,
            self.vehicle,
            _status(state),
            self._method,
            biases[0],
            biases[1:],
            self._rest.rest_s,
            self._used,
            self._refused,
            age_s,
            self._estimator.slope_left(),
        )
        self._ticks += 1
        if self._ticks % DIAGNOSTICS_EVERY == 0:
            counters = self._estimator.counters.by_name
            keys, values = tuple(counters), tuple(str(count) for count in counters.values())
            complaint = "" if self._stand_in is None else self._stand_in.complaint
            name = f"{self.vehicle}/fusion"
            summary = f"{name}: {complaint}" if complaint else ""
            yield Diagnostics(now_ns, self.vehicle, name, 1 if complaint else 0, summary, keys, values)

    def _propagate(self, imu: Imu) -> Iterator[Message]:
        """Integrate with the MCU's ticks; stamps only place the sample against the camera."""
        if not (imu.valid or (self._stand_in is not None and imu.usable & USABLE_RATE)):
            self._skipped_ms += imu.elapsed_ms
            return
        # samples that were refused as implausible are a hole of the same kind as lost frames
        dt_s = (imu.elapsed_ms + self._skipped_ms) * 1e-3 if imu.elapsed_ms else imu.window_s
        self._skipped_ms = 0
        force = imu.force_body_m_s2 if self._stand_in is None else self._stand_in.forces(imu, dt_s)
        packet = ImuPacket(imu.stamp_ns, dt_s, imu.rate_body_rad_s, *force, imu.temperature_c)
        state = self._estimator.add_imu(packet)
        for account in self._estimator.settled():
            if account.used or (account.t_exposure_ns, account.source) in self._waiting:  # else named overdue
                yield from self._receive_account(account, imu.stamp_ns)
        if state is not None:
            self._state = state
            yield self._say(state)

    def _correct(self, fix: PoseFix, source: str, now_ns: int) -> Iterator[Message]:
        if self._repeats.is_repeated(source, (fix.x_m, fix.y_m, fix.heading_rad)):
            self._estimator.counters.add("fix_" + REPEATS.replace(" ", "_"))
            nothing = (math.nan,) * 4
            yield self._account(FixOutcome(fix.stamp_ns, False, REPEATS, *nothing, source), now_ns)
            return
        covariance = np.array(fix.covariance).reshape(3, 3) + self._floors[source]
        if self._state is not None:  # an uncertain stamp of a moving vehicle is an uncertain pose
            motion = np.array([self._state.vx_m_s, self._state.vy_m_s, self._state.rate_rad_s])
            covariance += fix.stamp_sigma_s**2 * np.outer(motion, motion)
        account = self._estimator.add_fix(
            Fix(fix.stamp_ns, now_ns, fix.x_m, fix.y_m, fix.heading_rad, covariance, source)
        )
        yield from self._receive_account(account, now_ns)

    def _receive_account(self, account: FixOutcome, now_ns: int) -> Iterator[FixAccount]:
        """Pass on what became of a fix, once: when packets up to its exposure, or a second fix, are here."""
        if account.reason in (WAITS, CANDIDATE):
            self._waiting[account.t_exposure_ns, account.source] = now_ns, account
        else:
            yield self._account(account, now_ns)

    def _overdue(self, now_ns: int) -> Iterator[FixAccount]:
        """Name the fixes that wait in vain; should one be used after all, a second account follows."""
        for arrived_ns, account in tuple(self._waiting.values()):
            if account.reason == WAITS and now_ns - arrived_ns > LONGEST_WAIT_NS:
                yield self._account(account._replace(reason=NO_PACKETS), now_ns)
            elif account.reason == CANDIDATE and now_ns - arrived_ns > LONGEST_ALONE_NS:
                yield self._account(account, now_ns)

    def _account(self, account: FixOutcome, now_ns: int) -> FixAccount:
        self._waiting.pop((account.t_exposure_ns, account.source), None)
        self._used += account.used
        self._refused += not account.used
        if account.used:
            self._fix_stamp_ns = max(self._fix_stamp_ns, account.t_exposure_ns)
        innovation = (
            account.innovation_x_m,
            account.innovation_y_m,
            account.innovation_heading_rad,
        )
        age_s = (now_ns - account.t_exposure_ns) * 1e-9
        return FixAccount(
            account.t_exposure_ns,
            self.vehicle,
            account.source,
            account.used,
            account.reason,
            innovation,
            account.nis,
            age_s,
        )

    def _say(self, state: PlanarState) -> VehicleState:
        return VehicleState(
            state.t_ns,
            self.vehicle,
            (state.x_m, state.y_m),
            wrap_angle(state.heading_rad),
            (state.vx_m_s, state.vy_m_s),
            state.rate_rad_s,
            (state.sigma_x_m, state.sigma_y_m, state.sigma_heading_rad),
            _status(state),
            self._fix_stamp_ns,
        )

    def _receive_float(self, now_ns: int, *, floating: bool) -> None:
        if floating:
            self._follow_rest(self._rest.float_up(now_ns))
        else:
            self._rest.land()

    def _follow_rest(self, change: RestChange | None) -> None:
        if change is None:
            return
        if change.begins:
            self._estimator.begin_rest(change.t_ns)
        else:
            self._estimator.end_rest(change.t_ns)


def _status(state: PlanarState | None) -> str:
    if state is None:
        return "starting"
    return "lost" if state.is_lost else "flying"
