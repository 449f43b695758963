"""Fault detector: what the flight process sees wrong with sensors, fixes and valves of its vehicle."""

from collections.abc import Iterator

from groundstation.declarations.fix import PoseFix
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.fusion.messages import FixAccount
from groundstation.parts.imu.messages import USABLE_RATE, Imu
from groundstation.parts.supervision.messages import Findings
from groundstation.supervision.fix_watch import FixWatch
from groundstation.supervision.imu_watch import ImuWatch

PERIOD_NS = 50_000_000
REPEAT_NS = 200_000_000


class FaultDetector(Node):
    """Publishes what it finds at once when that changes, and five times a second.

    Args:
        vehicle: Its name.
        fixes: Classes of the fixes that fusion takes.
    """

    inputs: tuple[type[Message], ...] = (Imu, FixAccount, PoseFix)
    outputs = (Findings,)

    def __init__(self, vehicle: str, fixes: tuple[type[PoseFix], ...]) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self.inputs = (Imu, FixAccount, *fixes)
        self._imu = ImuWatch()
        self._fixes = FixWatch()
        self._published: tuple[str, ...] = ()
        self._published_ns = 0

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case Imu():
                self._imu.take(
                    now_ns,
                    is_valid=message.valid,
                    is_rate_usable=bool(message.usable & USABLE_RATE),
                    reason=message.reason,
                    elapsed_ms=message.elapsed_ms,
                )
            case FixAccount():
                self._fixes.take_account(now_ns, is_used=message.used, reason=message.reason)
            case PoseFix(fix=False):
                self._fixes.take_picture(now_ns, str(getattr(message, "reason", "")))
        yield from ()

    def tick(self, now_ns: int) -> Iterator[Message]:
        found = dict(self._imu.findings(now_ns))
        found.update(self._fixes.findings(now_ns))
        ids = tuple(found)
        if ids != self._published or now_ns - self._published_ns >= REPEAT_NS:
            self._published, self._published_ns = ids, now_ns
            yield Findings(now_ns, self.vehicle, ids, tuple(found.values()))
