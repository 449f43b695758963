"""The latency ledger: how old the light and the inertia are at every stage, from envelopes alone.

Two chains per vehicle. *Light*: exposure's middle, arrival of the frame, spots, fix, first state that
holds the fix, first wrench from such a state, valve command, CAN frame. *Inertia*: bytes arrived, state
published. Every valve command names its causes; ``causes_of`` walks them back.
"""

from collections import OrderedDict, defaultdict, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from groundstation.bus.envelope import Cause, Delivered, Envelope
from groundstation.bus.topics import TOPICS, topic_of
from groundstation.messages import definitions as m
from groundstation.messages.base import Message

K = TypeVar("K")
V = TypeVar("V")

STAGES = ("arrival", "spots", "fix", "state", "wrench", "guard", "bus", "bytes_to_state")
"""Ages since the exposure's middle, but the last: from bytes arrived to state published."""

_KEPT = 4096
_WINDOW = 2000
_STATE = topic_of(m.VehicleState).index
_IMU = topic_of(m.Imu).index
_IMU_BYTES = topic_of(m.ImuBytes).index
HEARD: frozenset[type[Message]] = frozenset(
    {
        m.ImuBytes,
        m.Imu,
        m.StarSpots,
        m.StarFix,
        m.VehicleState,
        m.Wrench,
        m.ValveDemand,
        m.ValveSelection,
        m.ValveCommand,
        m.CanOut,
    }
)


@dataclass(slots=True)
class _Vehicle:
    envelopes: OrderedDict[Cause, Envelope] = field(default_factory=OrderedDict)
    stamps: OrderedDict[Cause, int] = field(default_factory=OrderedDict)
    exposure_of_state: OrderedDict[int, int] = field(default_factory=OrderedDict)
    reached: dict[str, int] = field(default_factory=dict)  # stage -> newest exposure that got there
    ages_s: dict[str, deque[float]] = field(
        default_factory=lambda: {stage: deque(maxlen=_WINDOW) for stage in STAGES}
    )


class Ledger:
    """Follows the messages of all vehicles; give it every message of ``HEARD`` in any order."""

    def __init__(self) -> None:
        self._vehicles: defaultdict[str, _Vehicle] = defaultdict(_Vehicle)

    def take(self, delivered: Delivered) -> None:
        """Account for one message."""
        envelope, payload = delivered
        vehicle = self._vehicles[payload.vehicle]
        key = Cause(envelope.topic.index, envelope.sequence)
        _keep(vehicle.envelopes, key, envelope)
        match payload:
            case m.ImuBytes():
                _keep(vehicle.stamps, key, payload.stamp_ns)
            case m.StarSpots():
                self._reach(vehicle, "arrival", payload.stamp_ns, payload.arrival_ns)
                self._reach(vehicle, "spots", payload.stamp_ns, envelope.publish_ns)
            case m.StarFix(fix=True):
                self._reach(vehicle, "fix", payload.stamp_ns, envelope.publish_ns)
            case m.VehicleState():
                _keep(vehicle.exposure_of_state, envelope.sequence, payload.fix_stamp_ns)
                self._reach(vehicle, "state", payload.fix_stamp_ns, envelope.publish_ns)
                self._inertia(vehicle, envelope)
            case m.Wrench():
                self._downstream(vehicle, "wrench", envelope)
            case m.ValveCommand():
                self._downstream(vehicle, "guard", envelope)
            case m.CanOut():
                self._downstream(vehicle, "bus", envelope)

    def causes_of(self, vehicle: str, cause: Cause) -> Iterator[Envelope]:
        """Envelopes of a message and of all it was made from, newest first, as far as still kept."""
        kept = self._vehicles[vehicle].envelopes
        waiting, seen = [cause], {cause}
        while waiting:
            envelope = kept.get(waiting.pop(0))
            if envelope is None:
                continue
            yield envelope
            fresh = [c for c in envelope.causes if c not in seen]
            seen.update(fresh)
            waiting.extend(fresh)

    def vehicles(self) -> tuple[str, ...]:
        """Vehicles heard of."""
        return tuple(self._vehicles)

    def summary(self, vehicle: str, stamp_ns: int) -> m.Latency:
        """Ages of the last ``_WINDOW`` samples per stage, as the bus reports them; NaN where none."""
        ages = self._vehicles[vehicle].ages_s
        p50, p99 = [], []
        for stage in STAGES:
            values = np.fromiter(ages[stage], float)
            low, high = np.percentile(values, (50, 99)) if values.size else (np.nan, np.nan)
            p50.append(float(low))
            p99.append(float(high))
        return m.Latency(stamp_ns, vehicle, STAGES, tuple(p50), tuple(p99))

    @staticmethod
    def _reach(vehicle: _Vehicle, stage: str, exposure_ns: int, publish_ns: int) -> None:
        """Count the first time that light of this exposure reaches a stage."""
        if exposure_ns > vehicle.reached.get(stage, 0):
            vehicle.reached[stage] = exposure_ns
            vehicle.ages_s[stage].append((publish_ns - exposure_ns) * 1e-9)

    def _inertia(self, vehicle: _Vehicle, envelope: Envelope) -> None:
        imu = next((c for c in envelope.causes if c.topic_index == _IMU), None)
        made = vehicle.envelopes.get(imu) if imu is not None else None
        if made is None:
            return
        read = next((c for c in made.causes if c.topic_index == _IMU_BYTES), None)
        arrived_ns = vehicle.stamps.get(read) if read is not None else None
        if arrived_ns is not None:
            vehicle.ages_s["bytes_to_state"].append((envelope.publish_ns - arrived_ns) * 1e-9)

    def _downstream(self, vehicle: _Vehicle, stage: str, envelope: Envelope) -> None:
        """Find the state that a command came from, and the light in it."""
        key = Cause(envelope.topic.index, envelope.sequence)
        for ancestor in self._walk(vehicle, key):
            if ancestor.topic.index == _STATE:
                exposure_ns = vehicle.exposure_of_state.get(ancestor.sequence, 0)
                self._reach(vehicle, stage, exposure_ns, envelope.publish_ns)
                return

    @staticmethod
    def _walk(vehicle: _Vehicle, cause: Cause) -> Iterator[Envelope]:
        """The chain of triggers, i.e. first causes, from a message back."""
        for _ in range(len(TOPICS)):
            envelope = vehicle.envelopes.get(cause)
            if envelope is None:
                return
            yield envelope
            demand = [c for c in envelope.causes if c.topic_index < cause.topic_index]
            if not demand:
                return
            cause = max(demand)


def _keep(kept: OrderedDict[K, V], key: K, value: V) -> None:
    kept[key] = value
    if len(kept) > _KEPT:
        kept.popitem(last=False)
