"""A small flight to record: two vehicles, every kind of scope, an image now and then."""

import math

import numpy as np
import pytest

from groundstation.bus.cdr import ros_fields
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.journal import Journal, JournalWriter, Kind
from groundstation.declarations.topic import Scope
from groundstation.parts.control.messages import Wrench
from groundstation.parts.imu.messages import ImuBytes
from groundstation.parts.stars.messages import StarImage, StarSpots
from groundstation.parts.valves.messages import CanIn

PERIOD_NS = 10_000_000


def envelope_of(payload, sequence, process, publish_ns):
    topic = payload.TOPIC
    owner = process if topic.scope is Scope.PROCESS else payload.vehicle
    return Envelope(topic, owner, sequence, publish_ns)


def spots(stamp_ns, vehicle, some):
    """Three spots; every array of the payload holds ``some``."""
    empty = {"float32[]": some, "float64": 1.5, "int64": stamp_ns, "uint16": 3, "bool": False, "string": ""}
    return StarSpots(stamp_ns, vehicle, *(empty[kind] for _, kind in ros_fields(StarSpots)))


def fly(steps: int, seed: int = 7) -> list[Delivered]:
    """Messages in the order of their publication, 10 ms apart."""
    random = np.random.default_rng(seed)
    counts: dict = {}
    flight = []
    journal = JournalWriter()

    def publish(payload, publish_ns):
        key = (type(payload), payload.vehicle)
        counts[key] = counts.get(key, 0) + 1
        flight.append(Delivered(envelope_of(payload, counts[key], "flight", publish_ns), payload))

    for step in range(steps):
        now_ns = (step + 1) * PERIOD_NS
        for vehicle in ("alpha", "bravo"):
            publish(ImuBytes(now_ns, vehicle, random.bytes(62), math.nan), now_ns)
            force = tuple(random.normal(size=2).tolist())
            publish(Wrench(now_ns, vehicle, *force, 0.0, 0.0, 0.0, float(random.normal())), now_ns)
        publish(CanIn(now_ns, "", 0x181, random.bytes(8), 1), now_ns)
        if step % 7 == 0:
            publish(StarImage(now_ns, "alpha", now_ns - 1, 8, 8, "mono8", 8, random.bytes(64)), now_ns)
            publish(spots(now_ns, "alpha", random.normal(size=3).astype(np.float32)), now_ns)
        if step % 10 == 9:
            journal.note(Kind.TICK, "alpha/imu", "", "alpha", 0, now_ns, int(random.integers(2**32)))
            publish(Journal(now_ns, "", "flight", *journal.take()), now_ns)
    return flight


@pytest.fixture(scope="session")
def small_flight():
    return fly


@pytest.fixture(scope="session")
def flight():
    return fly(120)
