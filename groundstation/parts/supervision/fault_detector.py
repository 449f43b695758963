"""Fault detector: what the flight process sees wrong with sensors, fixes and valves of its vehicle."""

from collections.abc import Iterator, Mapping

from groundstation.control.valve_health import HEALTHY, ValveHealth
from groundstation.declarations.fix import PoseFix
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.fusion.hold_up import HoldUp
from groundstation.parts.fusion.messages import FixAccount, FusionStatus
from groundstation.parts.imu.messages import USABLE_RATE, Imu
from groundstation.parts.stars.messages import PictureTrouble
from groundstation.parts.supervision.messages import Findings, Supervision, ValveShares
from groundstation.parts.valves.messages import ValveCommand, ValveStatus
from groundstation.supervision.command_lag import CommandLag
from groundstation.supervision.fix_watch import FixWatch
from groundstation.supervision.imu_consistency import ImuConsistency
from groundstation.supervision.imu_watch import ImuWatch
from groundstation.supervision.valve_consistency import ValveConsistency

PERIOD_NS = 50_000_000
REPEAT_NS = 200_000_000
NODE_NS = 70_000_000
"""A node whose newest status is older may not have received the commands, which then explain nothing."""
HELD_UP_S = 0.03
"""Samples that are later than usual by more come by a line or a machine that is held up; so do commands."""
LONGEST_HOLE_MS, DISTURBED_NS = 60, 2_000_000_000
"""After a longer hole between samples nothing is judged for a while: filter and stamps settle."""
VALVES = 8
"""Of a valve node."""
MOST_BEHIND = 3
"""Commands, 20 ms each, that the node may be behind."""
FLOATING_NS = 300_000_000
"""While no status of the valve node says for so long that the air is on, bearings may stand on the glass: a
supervisor that is paused or dead publishes no landing, the node cuts the air itself."""
LIFTED_NS = 500_000_000
"""After the float air came on bearings lift: until then motion says nothing about valves."""


class FaultDetector(Node):
    """Publishes what it finds at once when that changes, and five times a second.

    Args:
        vehicle: Its name.
        fixes: Classes of the fixes that fusion takes, with the names of their sources.
        valves: Compares motion with commands.
        imu: Compares the gyro with fixes.
        hold_up: Follows how late samples come.
        has_pictures: Whether fixes are made of pictures that are checked one by one.
    """

    inputs: tuple[type[Message], ...] = (
        Imu, FixAccount, FusionStatus, ValveCommand, ValveStatus, Supervision, PictureTrouble, PoseFix,
    )  # fmt: skip
    outputs = (Findings, ValveShares)

    def __init__(
        self,
        vehicle: str,
        fixes: dict[type[PoseFix], str],
        valves: ValveConsistency,
        imu: ImuConsistency,
        hold_up: HoldUp,
        *,
        has_pictures: bool = False,
    ) -> None:
        super().__init__(vehicle, PERIOD_NS)
        own = (Imu, FixAccount, FusionStatus, ValveCommand, ValveStatus, Supervision)
        self.inputs = (*own, *((PictureTrouble,) if has_pictures else ()), *fixes)
        self._sources = fixes
        self._poses: dict[str, tuple[float, float, float]] = {}
        self._imu_watch = ImuWatch()
        self._fix_watch = FixWatch()
        self._valves = valves
        self._imu = imu
        self._hold_up = hold_up
        self._zeros = (0.0, (0.0, 0.0))  # of the rate, of the forces
        self._floats_from_ns: int | None = None
        self._node_ns = 0
        self._floating_ns = -FLOATING_NS  # the newest status by which the air is on
        self._lag = CommandLag()
        self._disturbed_ns = -DISTURBED_NS
        self._has_rested = False  # as long as the process lives: one that starts in flight knows no zeros
        self._health: Mapping[int, ValveHealth] = {}
        self._published: tuple[str, ...] = ()
        self._published_ns = 0

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case Imu():
                if self._sample(message, now_ns):
                    yield from self._report(now_ns)
            case ValveCommand():
                self._lag.command(message.stamp_ns, message.counter)
                if self._floats_from_ns is not None:
                    self._valves.command(message.stamp_ns, message.pulse_id, message.on_time_ms)
            case ValveStatus():
                if self._lag.is_late(message.stamp_ns, message.counter):
                    self._valves.skip_late_command()
                if message.floating:
                    self._floating_ns = now_ns
                if (
                    message.armed
                    and not message.dead_man
                    and self._lag.behind(message.counter) <= MOST_BEHIND
                ):
                    self._node_ns = now_ns
            case PoseFix():
                self._fix(message, now_ns)
            case PictureTrouble():
                self._fix_watch.take_picture(now_ns, message.reason)
            case FixAccount():
                self._account(message, now_ns)
            case FusionStatus():
                self._zeros = message.bias_rate_rad_s, message.bias_force_m_s2
                self._has_rested = message.rest_s > 0.0
                if self._is_carried(now_ns):
                    self._imu.zero(now_ns, self._zeros[0])
            case Supervision():
                self._follow(message, now_ns)

    def tick(self, now_ns: int) -> Iterator[Message]:
        yield from self._report(now_ns)

    def _is_carried(self, now_ns: int) -> bool:
        """Whether motion can be judged: bearings carry, and a rest has shown the zero offsets."""
        if not self._has_rested or now_ns - self._disturbed_ns < DISTURBED_NS:
            return False
        return self._floats_from_ns is not None and now_ns >= self._floats_from_ns

    def _follow(self, ruling: Supervision, now_ns: int) -> None:
        """The air comes on or goes; what was found in a flight stays with the supervisor, not here."""
        if ruling.is_in_flight and self._floats_from_ns is None:
            self._floats_from_ns = now_ns + LIFTED_NS
            self._valves.start(self._zeros[1])
        elif not ruling.air_on and self._floats_from_ns is not None:
            self._floats_from_ns = None
            self._valves.reset()
            self._imu.reset()

    def _sample(self, imu: Imu, now_ns: int) -> bool:
        self._imu_watch.take(
            now_ns,
            is_valid=imu.valid,
            is_rate_usable=bool(imu.usable & USABLE_RATE),
            reason=imu.reason,
            tick_ms=imu.tick_ms,
        )
        self._hold_up.sample(now_ns, imu.stamp_ns)
        if self._floats_from_ns is not None and now_ns - self._floating_ns > FLOATING_NS:
            self._disturb(now_ns)
        if not (imu.valid and self._is_carried(now_ns)):
            return False
        if imu.elapsed_ms > LONGEST_HOLE_MS or self._hold_up.excess_s(now_ns) > HELD_UP_S:
            self._disturb(now_ns)
        rate_rad_s = imu.rate_body_rad_s - self._zeros[0]
        self._imu.sample(imu.stamp_ns, rate_rad_s)
        if now_ns - self._node_ns > NODE_NS:
            self._begin_again()
            return False
        return self._valves.sample(imu.stamp_ns, imu.window_s, rate_rad_s, imu.force_body_m_s2)

    def _disturb(self, now_ns: int) -> None:
        """What was gathered is of another motion; for a while nothing is judged."""
        self._disturbed_ns = now_ns
        self._imu.reset()
        self._begin_again()

    def _begin_again(self) -> None:
        """What was found stays: a hole in the samples mends no valve."""
        self._valves.start(self._zeros[1])

    def _fix(self, fix: PoseFix, now_ns: int) -> None:
        if not fix.fix:
            self._fix_watch.take_picture(now_ns, str(getattr(fix, "reason", "")))
            return
        source, pose = self._sources[type(fix)], (fix.x_m, fix.y_m, fix.heading_rad)
        is_repeated, self._poses[source] = pose == self._poses.get(source), pose
        if self._is_carried(now_ns) and not is_repeated:  # a camera that repeats itself tells of no turn
            self._imu.fix(source, fix.stamp_ns, fix.heading_rad, fix.stamp_sigma_s)

    def _account(self, account: FixAccount, now_ns: int) -> None:
        self._fix_watch.take_account(now_ns, account.stamp_ns, is_used=account.used, reason=account.reason)
        if self._is_carried(now_ns):
            self._imu.account(
                account.source,
                used=account.used,
                reason=account.reason,
                innovation=account.innovation,
                nis=account.nis,
            )

    def _report(self, now_ns: int) -> Iterator[Message]:
        found = dict(self._imu_watch.findings(now_ns))
        found.update(self._fix_watch.findings(now_ns))
        for finding in (*self._valves.findings(now_ns), *self._imu.findings):
            before = found.get(finding.id)
            found[finding.id] = finding.detail if before is None else f"{before}; {finding.detail}"
        if self._valves.health != self._health:
            self._health = self._valves.health
            yield self._shares(now_ns)
        ids = tuple(found)
        if ids != self._published or now_ns - self._published_ns >= REPEAT_NS:
            self._published, self._published_ns = ids, now_ns
            yield Findings(now_ns, self.vehicle, ids, tuple(found.values()))

    def _shares(self, now_ns: int) -> ValveShares:
        health = [self._health.get(valve, HEALTHY) for valve in range(VALVES)]
        return ValveShares(
            now_ns,
            self.vehicle,
            tuple(valve.open_share for valve in health),
            tuple(valve.shut_share for valve in health),
        )
