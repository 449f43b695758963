"""A console that a test feeds by hand: batches of the record stream, a source without a flight."""

import time
from collections.abc import Iterable, Mapping
from typing import Any

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter
from groundstation.console.events import Events
from groundstation.console.feed import Feed
from groundstation.console.rig_page import rig_page
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.parts.fusion.messages import VehicleState


def batch_of(messages: Iterable[Message]) -> bytes:
    """A batch of the record stream."""
    writer = RecordWriter()
    for number, message in enumerate(messages, 1):
        envelope = Envelope(message.TOPIC, message.vehicle, number, message.stamp_ns)
        writer.add(envelope, codec_of(type(message)).encode(message))
    return writer.take()


def state_of(vehicle: str, stamp_ns: int, x_m: float = 0.25, heading_rad: float = 0.5) -> VehicleState:
    return VehicleState(
        stamp_ns, vehicle, (x_m, -0.5), heading_rad, (0.01, 0.0), 0.02, (1e-3, 1e-3, 1e-3), "flying", 0
    )


class HandSource:
    """A source that a test fills."""

    def __init__(self, rig: Rig, feed: Feed) -> None:
        self.feed, self.vehicles = feed, tuple(rig.vehicles)
        self.events = Events(feed)
        self.page: dict[str, Any] = {**rig_page(rig), "kind": "live"}

    def step(self) -> int:
        return time.monotonic_ns()

    def extra(self) -> dict[str, Any]:
        return {}

    def control(self, asked: Mapping[str, Any]) -> None:
        raise ValueError(f"{asked} cannot be")

    def columns(self, names: Iterable[str]) -> None:
        del names

    def close(self) -> None:
        pass
