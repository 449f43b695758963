"""How topics are named where ROS 2 nodes look for them: keys, tokens, attachments, hashes of types.

Source: the design document of rmw_zenoh (docs/design.md) and its ``liveliness_utils.cpp``,
``attachment_helpers.cpp`` and ``type_support``, as of 2025: attachments without names (since June 2025, 0.1.2
of humble), nine parts behind the domain in a publisher's token. Types are hashed as REP 2011 and REP 2016
have it (RIHS01).
"""

import struct
from collections.abc import Iterable
from typing import NamedTuple

from groundstation.bridges.xxh3 import xxh3_128
from groundstation.bus.ros_schema import register
from groundstation.declarations.message import Message

ADMIN = "@ros2_lv"
NODE, PUBLISHER = "NN", "MP"
NODE_ID = 0
EMPTY = "%"
"""Stands for a slash; alone for an empty namespace or enclave: no part of a key may be empty."""
QOS = "::,10:,:,:,,"
"""Reliable, volatile, keep the last 10: only what differs from the defaults of rmw_zenoh is written."""
GID_BYTES = 16
_ATTACHMENT = struct.Struct(f"<qqB{GID_BYTES}s")


class RosTopic(NamedTuple):
    """A topic as ROS 2 nodes see it.

    Attributes:
        name: With its leading slash, ``/alpha/state``.
        type_name: As DDS writes it, ``air_table_msgs::msg::dds_::VehicleState_``.
        type_hash: ``RIHS01_`` and 64 digits.
    """

    name: str
    type_name: str
    type_hash: str

    def key(self, domain: int) -> str:
        """Where its messages are published."""
        return f"{domain}/{self.name.strip('/')}/{self.type_name}/{self.type_hash}"


def dds_name(ros_type: str) -> str:
    """``package/msg/Name`` as DDS writes it."""
    package, kind, name = ros_type.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def type_hashes(kinds: Iterable[type[Message]]) -> dict[str, str]:
    """Hashes of the types of payloads, by the name of the type."""
    from rosbags.typesys import Stores, get_typestore  # a third of a second, in the bridge alone

    listed = list(kinds)
    store = get_typestore(Stores.ROS2_JAZZY)
    register(store, listed)
    return {kind.ROS_TYPE: str(store.hash_rihs01(kind.ROS_TYPE)) for kind in listed}


def node_token(domain: int, session: str, node: str) -> str:
    """Token of a node.

    Args:
        domain: Of ROS.
        session: Zenoh's id of the session.
        node: Name.
    """
    return "/".join((ADMIN, str(domain), session, str(NODE_ID), str(NODE_ID), NODE, EMPTY, EMPTY, node))


def publisher_token(domain: int, session: str, node: str, number: int, topic: RosTopic) -> str:
    """Token of a publisher.

    Args:
        domain: Of ROS.
        session: Zenoh's id of the session.
        node: Name of its node.
        number: Of the publisher, unique in the session.
        topic: What it publishes.
    """
    name = topic.name.replace("/", EMPTY)
    return "/".join(
        (
            ADMIN, str(domain), session, str(NODE_ID), str(number), PUBLISHER, EMPTY, EMPTY, node,
            name, topic.type_name, topic.type_hash, QOS,
        )
    )  # fmt: skip


def gid_of(token: str) -> bytes:
    """What a publisher is known by, 16 bytes: the hash of its token, low half first, little endian."""
    return xxh3_128(token.encode()).to_bytes(GID_BYTES, "little")


def attachment(sequence: int, utc_ns: int, gid: bytes) -> bytes:
    """What travels with a message.

    Args:
        sequence: Counts the messages of a publisher, from 1.
        utc_ns: When it was published.
        gid: Of the publisher.
    """
    return _ATTACHMENT.pack(sequence, utc_ns, GID_BYTES, gid)
