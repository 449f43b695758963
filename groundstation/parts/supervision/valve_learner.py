"""Valve learner: thrust and dead time of each valve, from what was commanded and how the vehicle moved."""

import math
from collections.abc import Iterator

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.fusion.messages import FusionStatus
from groundstation.parts.imu.messages import Imu
from groundstation.parts.supervision.messages import Supervision, ValveShares, ValvesLearned
from groundstation.parts.valves.messages import ValveCommand
from groundstation.supervision.valve_estimate import Learned
from groundstation.supervision.valve_identification import ValveIdentification

PERIOD_NS = 1_000_000_000
LIFTED_NS = 500_000_000
"""After the float air came on bearings lift: until then motion says nothing about valves."""
UNKNOWN = Learned(math.nan, math.nan)


class ValveLearner(Node):
    """Learns while the vehicle floats and no valve is known to be broken; publishes once a second.

    Args:
        vehicle: Its name.
        identification: Learns.
    """

    inputs = (Imu, FusionStatus, ValveCommand, ValveShares, Supervision)
    outputs = (ValvesLearned,)

    def __init__(self, vehicle: str, identification: ValveIdentification) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self._identification = identification
        self._zero_rad_s = 0.0
        self._zeros_m_s2 = self._start_zeros_m_s2 = (
            0.0,
            0.0,
        )  # the newest; at take-off
        self._has_rested = False  # one that starts in flight knows no zeros
        self._floats_from_ns: int | None = None
        self._shares: tuple[tuple[float, float], ...] = ()
        self._has_news = False

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case Imu() if message.valid and self._is_learning(now_ns):
                (x, y), (zero_x, zero_y) = message.force_body_m_s2, self._start_zeros_m_s2
                self._has_news |= self._identification.sample(
                    message.stamp_ns,
                    message.window_s,
                    message.rate_body_rad_s - self._zero_rad_s,
                    (x - zero_x, y - zero_y),
                )
            case ValveCommand() if self._floats_from_ns is not None:
                self._identification.command(message.stamp_ns, message.pulse_id, message.on_time_ms)
            case FusionStatus():
                self._zero_rad_s, self._has_rested = message.bias_rate_rad_s, message.rest_s > 0.0
                self._zeros_m_s2 = message.bias_force_m_s2
            case ValveShares():
                self._take_shares(message)
            case Supervision():
                self._follow(message, now_ns)
        yield from ()

    def tick(self, now_ns: int) -> Iterator[Message]:
        if not self._has_news:
            return
        self._has_news = False
        found = self._identification.estimates()
        thrust = [valve.thrust_over_mass or UNKNOWN for valve in found]
        torque = [valve.torque_over_inertia or UNKNOWN for valve in found]
        dead = [valve.dead_time_s or UNKNOWN for valve in found]
        yield ValvesLearned(
            now_ns,
            self.vehicle,
            tuple(one.value for one in thrust),
            tuple(one.sigma for one in thrust),
            tuple(one.value for one in torque),
            tuple(one.sigma for one in torque),
            tuple(one.value for one in dead),
            tuple(one.sigma for one in dead),
            tuple(valve.open_s for valve in found),
            self._identification.set_aside,
        )

    def _is_learning(self, now_ns: int) -> bool:
        """Whether motion can be explained by valves that do what they are told."""
        is_whole = all(share == (1.0, 0.0) for share in self._shares)
        afloat_ns = self._floats_from_ns
        return is_whole and self._has_rested and afloat_ns is not None and now_ns >= afloat_ns

    def _take_shares(self, message: ValveShares) -> None:
        """What was found broken, or mended, is learned anew."""
        shares = tuple(zip(message.open_ratio, message.shut_ratio, strict=True))
        before = self._shares or ((1.0, 0.0),) * len(shares)
        for valve, (now, then) in enumerate(zip(shares, before, strict=True)):
            if now != then:
                self._identification.forget(valve)
        self._shares = shares

    def _follow(self, ruling: Supervision, now_ns: int) -> None:
        if ruling.is_in_flight and self._floats_from_ns is None:
            self._floats_from_ns = now_ns + LIFTED_NS
            self._start_zeros_m_s2 = self._zeros_m_s2
            self._identification.start()
        elif not ruling.air_on:
            self._floats_from_ns = None
