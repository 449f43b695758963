"""The latency ledger: how old the light and the inertia are at every stage, from envelopes and triggers.

Two chains per vehicle. *Light*: middle of the exposure (as the star tracker concluded it), arrival of
the picture, spots, fix, first state that holds the fix, first wrench from such a state, past the guard,
CAN frame. *Inertia*: bytes arrived, state published.

The origin of a message (an exposure, an arrival of bytes) is that of its trigger. Record streams of several
processes come one before the other: a message whose trigger is not here yet waits for it.
"""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import NamedTuple, TypeVar

import numpy as np

from groundstation.bus.cdr import CodecError, codec_of, stamp_of
from groundstation.bus.envelope import Cause, Delivered
from groundstation.bus.record_stream import Recorded
from groundstation.declarations.message import Message
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.imu.messages import Imu, ImuBytes
from groundstation.parts.operation.messages import Latency
from groundstation.parts.stars.messages import StarFix, StarSpots
from groundstation.parts.valves.messages import CanOut, ValveCommand, ValveSelection

K = TypeVar("K")
V = TypeVar("V")

LIGHT = ("exposure", "arrival", "spots", "fix", "state", "wrench", "guard", "bus")
"""Ages since the middle of the exposure, in the order of the chain."""
BYTES_TO_STATE = "bytes_to_state"
"""From the arrival of the bytes to the state."""
STAGES = (*LIGHT, BYTES_TO_STATE)

_BY_STARS = frozenset(LIGHT[: LIGHT.index("state")])
_STAGE_OF = {Wrench.TOPIC.noun: "wrench", ValveCommand.TOPIC.noun: "guard", CanOut.TOPIC.noun: "bus"}
_READ: Mapping[str, type[Message]] = {
    kind.TOPIC.noun: kind for kind in (ImuBytes, StarSpots, StarFix, VehicleState)
}
_BEFORE: Mapping[type[Message], type[Message]] = {
    Imu: ImuBytes,
    Wrench: VehicleState,
    ValveSelection: Wrench,
    ValveCommand: ValveSelection,
    CanOut: ValveCommand,
}
"""What each link is made from; what was made from something else (a brake, an order to float) is no link."""
_PASSED_ON = {kind.TOPIC.noun: before.TOPIC.noun for kind, before in _BEFORE.items()}
FOLLOWED: Mapping[str, type[Message]] = {**_READ, **{kind.TOPIC.noun: kind for kind in _BEFORE}}
"""Classes that the ledger wants, by their nouns; it passes over all others."""

_STAMPED = frozenset({ImuBytes.TOPIC.noun, StarSpots.TOPIC.noun})
_SPOTS, _STATE = StarSpots.TOPIC.noun, VehicleState.TOPIC.noun
_SAMPLES = 2000
_ORIGINS = 16384
_WAITING = 4096


class _Link(NamedTuple):
    """A message on one of the chains."""

    key: Cause
    publish_ns: int
    stamp_ns: int = 0


def _samples() -> deque[float]:
    return deque(maxlen=_SAMPLES)


@dataclass(slots=True)
class _Vehicle:
    """When light of each exposure first reached each stage, and ages of the bytes at the state (s)."""

    first_ns: dict[str, dict[int, int]] = field(default_factory=lambda: {stage: {} for stage in LIGHT})
    bytes_to_state_s: deque[float] = field(default_factory=_samples)

    def reach(self, stage: str, exposure_ns: int, at_ns: int) -> None:
        """Light of an exposure reached a stage; the first time counts, in whatever order it is reported."""
        first_ns = self.first_ns[stage]
        known_ns = first_ns.get(exposure_ns)
        if known_ns is None:
            _keep(first_ns, exposure_ns, at_ns, _SAMPLES)
        elif at_ns < known_ns:
            first_ns[exposure_ns] = at_ns

    def ages_s(self, stage: str) -> list[float]:
        """Ages at a stage; where the star tracker makes fixes, only its exposures count."""
        if stage == BYTES_TO_STATE:
            return list(self.bytes_to_state_s)
        ages_ns, of_stars = self.first_ns[stage], self.first_ns["fix"]
        return [
            (at_ns - exposure_ns) * 1e-9
            for exposure_ns, at_ns in ages_ns.items()
            if stage in _BY_STARS or not of_stars or exposure_ns in of_stars
        ]


class Ledger:
    """Follows the messages of all vehicles, in any order; messages that are on no chain are passed over."""

    def __init__(self) -> None:
        self._vehicles: dict[str, _Vehicle] = {}
        self._origins_ns: dict[Cause, int] = {}
        self._waiting: dict[Cause, list[_Link]] = {}

    def take(self, recorded: Recorded, payload: Message | None = None) -> None:
        """Account for a message of the record stream.

        Args:
            recorded: The message.
            payload: Its payload, where it has been decoded anyway.
        """
        noun = recorded.noun
        if noun in _PASSED_ON:
            self._pass_on(
                Cause(noun, recorded.owner, recorded.sequence), recorded.publish_ns, recorded.trigger
            )
        elif noun in _READ:
            key = Cause(noun, recorded.owner, recorded.sequence)
            try:
                if noun in _STAMPED:
                    self._read_stamp(key, recorded.publish_ns, stamp_of(recorded.data))
                    return
                if payload is None:
                    payload = codec_of(_READ[noun]).decode(recorded.data)
            except CodecError:
                return  # whoever shows messages counts these
            self._read(key, recorded.publish_ns, recorded.trigger, payload)

    def take_delivered(self, delivered: Delivered) -> None:
        """Account for a message that was never encoded, in lockstep."""
        envelope, payload = delivered
        topic, owner, sequence, publish_ns, _, trigger = envelope
        noun = topic.noun
        if noun in _PASSED_ON:
            self._pass_on(Cause(noun, owner, sequence), publish_ns, trigger)
        elif noun in _STAMPED:
            self._read_stamp(Cause(noun, owner, sequence), publish_ns, payload.stamp_ns)
        elif noun in _READ:
            self._read(Cause(noun, owner, sequence), publish_ns, trigger, payload)

    def summary(self, vehicle: str, stamp_ns: int) -> Latency:
        """Percentiles of the ages at each stage over the last samples; NaN where there are none."""
        known = self._vehicles.get(vehicle)
        p50_s, p99_s = [], []
        for stage in STAGES:
            ages_s = known.ages_s(stage) if known is not None else []
            low, high = np.percentile(ages_s, (50, 99)).tolist() if ages_s else (math.nan, math.nan)
            p50_s.append(low)
            p99_s.append(high)
        return Latency(stamp_ns, vehicle, STAGES, tuple(p50_s), tuple(p99_s))

    def _read_stamp(self, key: Cause, publish_ns: int, stamp_ns: int) -> None:
        """A message of which nothing but the stamp, an arrival, is of interest."""
        if key.noun == _SPOTS:  # its fix will name the exposure
            self._await(key, _Link(key, publish_ns, stamp_ns))
        else:
            self._learn(key, stamp_ns)

    def _read(self, key: Cause, publish_ns: int, trigger: Cause | None, payload: Message) -> None:
        """A message that states something of an origin."""
        if isinstance(payload, StarFix):
            vehicle = self._vehicle(key.owner)
            vehicle.reach("exposure", payload.stamp_ns, payload.stamp_ns)
            if payload.fix:
                vehicle.reach("fix", payload.stamp_ns, publish_ns)
            if trigger is not None:
                self._learn(trigger, payload.stamp_ns)
        elif isinstance(payload, VehicleState):
            if payload.fix_stamp_ns:
                self._vehicle(key.owner).reach("state", payload.fix_stamp_ns, publish_ns)
            self._learn(key, payload.fix_stamp_ns)
            if trigger is not None:
                self._await(trigger, _Link(key, publish_ns))

    def _pass_on(self, key: Cause, publish_ns: int, trigger: Cause | None) -> None:
        """A message whose origin is that of what triggered it."""
        if trigger is not None and trigger.noun == _PASSED_ON[key.noun]:
            self._await(trigger, _Link(key, publish_ns))

    def _await(self, cause: Cause, link: _Link) -> None:
        origin_ns = self._origins_ns.get(cause)
        if origin_ns is not None:
            self._follow(link, origin_ns)
            return
        links = self._waiting.get(cause)
        if links is None:
            _keep(self._waiting, cause, [link], _WAITING)
        else:
            links.append(link)

    def _learn(self, key: Cause, origin_ns: int) -> None:
        """The origin of a message is known (0: there is none yet), so is that of all that waited for it."""
        _keep(self._origins_ns, key, origin_ns, _ORIGINS)
        for link in self._waiting.pop(key, ()):
            self._follow(link, origin_ns)

    def _follow(self, link: _Link, origin_ns: int) -> None:
        noun, vehicle = link.key.noun, self._vehicle(link.key.owner)
        if noun == _SPOTS:
            vehicle.reach("arrival", origin_ns, link.stamp_ns)
            vehicle.reach("spots", origin_ns, link.publish_ns)
        elif noun == _STATE:
            vehicle.bytes_to_state_s.append((link.publish_ns - origin_ns) * 1e-9)
        else:
            stage = _STAGE_OF.get(noun)
            if stage is not None and origin_ns:
                vehicle.reach(stage, origin_ns, link.publish_ns)
            self._learn(link.key, origin_ns)

    def _vehicle(self, name: str) -> _Vehicle:
        found = self._vehicles.get(name)
        if found is None:
            found = self._vehicles[name] = _Vehicle()
        return found


def _keep(kept: dict[K, V], key: K, value: V, limit: int) -> None:
    """Put into a dictionary that forgets its oldest half when it is full."""
    kept[key] = value
    if len(kept) > limit:
        for old in list(islice(kept, limit // 2)):
            del kept[old]
