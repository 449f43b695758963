"""The ROS 2 bridge: everything that a rig publishes, under the names that rmw_zenoh gives topics.

It is a process of its own with two sessions: one with the rig's hub, which it only listens to, and one with
the router of ROS 2 (``rmw_zenohd``). So nothing of ROS reaches the flight, and a router that is slow or gone
costs the flight nothing.

Headers are given UTC, as ROS 2 nodes expect; other stamps stay of the host's monotonic clock.
"""

import struct
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import NamedTuple

import zenoh

from groundstation.bridges.ros2_names import (
    RosTopic,
    attachment,
    dds_name,
    gid_of,
    node_token,
    publisher_token,
    type_hashes,
)
from groundstation.bus.journal import Journal
from groundstation.bus.record_stream import Recorded
from groundstation.bus.zenoh_bus import client_config
from groundstation.declarations.message import Message
from groundstation.declarations.names import ROS2
from groundstation.launch.attendant import Attendant
from groundstation.launch.onlooker import look_on
from groundstation.launch.orders import Orders
from groundstation.recording.channel_names import channel_name
from groundstation.rig.read import parse_rig

NODE = "ground_station"
RETRY_S = 2.0
LEAVES_OUT = frozenset({Journal.TOPIC.noun})
"""Bookkeeping of recordings, of no use to anybody who does not replay."""
_STAMP_AT = 4
_STAMP = struct.Struct("<iI")
_NS = 1_000_000_000
_FIRST_PUBLISHER = 1


class Told(NamedTuple):
    """What the bridge is told.

    Attributes:
        endpoint: Of the router of ROS 2.
        domain: Of ROS.
    """

    endpoint: str
    domain: int


class RosPublishers:
    """Publishes messages to ROS 2; tokens announce node and topics for as long as it lives.

    Args:
        session: With the router of ROS 2.
        domain: Of ROS.
        payloads: Payload classes by noun.
        hashes: Of their types, by the name of the type.
        utc_offset_ns: UTC minus monotonic clock.
    """

    def __init__(
        self,
        session: zenoh.Session,
        domain: int,
        payloads: Mapping[str, type[Message]],
        hashes: Mapping[str, str],
        utc_offset_ns: int,
    ) -> None:
        self._session = session
        self._domain = domain
        self._payloads = payloads
        self._hashes = hashes
        self._utc_offset_ns = utc_offset_ns
        self._name = str(session.info.zid())
        self._publishers: dict[tuple[str, str], _Publisher] = {}
        token = node_token(domain, self._name, NODE)
        self._token = session.liveliness().declare_token(token)  # it lasts as long as it is kept

    def take(self, recorded: Recorded) -> None:
        """Publish a message; one of no known topic is passed over."""
        kind = self._payloads.get(recorded.noun)
        if kind is None:
            return
        key = recorded.noun, recorded.owner
        publisher = self._publishers.get(key)
        if publisher is None:
            publisher = self._publishers[key] = self._open(kind, recorded.owner)
        utc_ns = recorded.publish_ns + self._utc_offset_ns
        publisher.put(in_utc(recorded.data, self._utc_offset_ns), utc_ns)

    def close(self) -> None:
        """End the session."""
        with suppress(zenoh.ZError):
            self._session.close()

    def _open(self, kind: type[Message], owner: str) -> "_Publisher":
        name = channel_name(kind.TOPIC.noun, owner)
        topic = RosTopic(name, dds_name(kind.ROS_TYPE), self._hashes[kind.ROS_TYPE])
        number = _FIRST_PUBLISHER + len(self._publishers)
        token = publisher_token(self._domain, self._name, NODE, number, topic)
        return _Publisher(self._session, topic.key(self._domain), token)


class _Publisher:
    """Of one topic."""

    def __init__(self, session: zenoh.Session, key: str, token: str) -> None:
        self._gid = gid_of(token)
        self._sequence = 0
        self._publisher = session.declare_publisher(
            key,
            encoding=zenoh.Encoding.APPLICATION_CDR,
            congestion_control=zenoh.CongestionControl.DROP,  # who looks on from far away delays nobody
        )
        self._token = session.liveliness().declare_token(token)

    def put(self, data: bytes, utc_ns: int) -> None:
        self._sequence += 1
        self._publisher.put(data, attachment=attachment(self._sequence, utc_ns, self._gid))


def in_utc(data: bytes, utc_offset_ns: int) -> bytes:
    """A payload whose header has UTC; its stamp comes first in all, behind the encapsulation header."""
    seconds, nanoseconds = _STAMP.unpack_from(data, _STAMP_AT)
    stamp_ns = seconds * _NS + nanoseconds + utc_offset_ns
    stamp = _STAMP.pack(*divmod(stamp_ns, _NS))
    return data[:_STAMP_AT] + stamp + data[_STAMP_AT + _STAMP.size :]


class _Bridge:
    """Connects as soon as there is a router, and publishes from then on.

    Args:
        told: Where the router is.
        payloads: Payload classes by noun.
        utc_offset_ns: UTC minus monotonic clock.
    """

    def __init__(self, told: Told, payloads: Mapping[str, type[Message]], utc_offset_ns: int) -> None:
        self._endpoint, self._domain = told
        self._payloads = {noun: kind for noun, kind in payloads.items() if noun not in LEAVES_OUT}
        self._hashes = type_hashes(self._payloads.values())
        self._utc_offset_ns = utc_offset_ns
        self._publishers: RosPublishers | None = None
        self._retry_s = 0.0
        self._is_missed = False

    def tick(self) -> None:
        """Connect, if that is due."""
        if self._publishers is not None or time.monotonic() < self._retry_s:
            return
        try:
            session = zenoh.open(client_config(self._endpoint))
        except zenoh.ZError:
            self._retry_s = time.monotonic() + RETRY_S
            if not self._is_missed:
                self._is_missed = True
                _say(f"no router of ROS 2 answers at {self._endpoint}; it is tried again every {RETRY_S:g} s")
            return
        self._publishers = RosPublishers(
            session, self._domain, self._payloads, self._hashes, self._utc_offset_ns
        )
        _say(f"publishes to the router of ROS 2 at {self._endpoint}, domain {self._domain}")

    def take(self, recorded: Recorded) -> None:
        """Publish a message, where there is a router."""
        if self._publishers is not None:
            self._publishers.take(recorded)

    def close(self) -> None:
        """End the session."""
        if self._publishers is not None:
            self._publishers.close()


def attendant(told: Told) -> Attendant:
    """The bridge as the launcher runs it."""
    return Attendant(ROS2, f"{__name__}:run", told)


def run(orders: Orders) -> None:
    """Bridge until asked to stop; what the launcher's attendant calls."""
    rig = parse_rig(orders.rig_text, orders.rig_path, orders.files)
    payloads = rig.tables.payloads
    assert orders.attendant is not None
    told = orders.attendant.options
    assert isinstance(told, Told)
    bridge = _Bridge(told, payloads, orders.utc_offset_ns)
    latched = {noun for noun, kind in payloads.items() if kind.TOPIC.latched}
    try:
        look_on(orders, bridge.take, latched, bridge.tick)
    finally:
        bridge.close()


def _say(line: str) -> None:
    """What the launcher shows."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()
