"""One request to a running rig, and its answer."""

import json
import os
import time
from collections.abc import Mapping

import zenoh

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.listener import Listener
from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.declarations.errors import GroundStationError
from groundstation.declarations.request import Ack, Request, Value


def ask(
    endpoint: str, vehicle: str, action: str, arguments: Mapping[str, Value], author: str, timeout_s: float
) -> Ack:
    """Publish a request and wait for its ack.

    Args:
        endpoint: Of the hub.
        vehicle: Of whom it is requested.
        action: Name of an action.
        arguments: Of the action, checked by its row; SI and radians.
        author: Who asks.
        timeout_s: How long to wait.

    Raises:
        GroundStationError: The hub is not there, or nobody answers in time.
    """
    now_ns = time.monotonic_ns()
    number = now_ns // 1_000_000 % 2**32  # unique per author
    request = Request(now_ns, vehicle, number, author, action, json.dumps(dict(arguments)))
    process = f"operator_{os.getpid()}"  # a process of its own, as the recording sees it
    try:
        with ZenohBus(endpoint) as bus:
            acks = Listener(bus, (Ack,))
            envelope = Envelope(Request.TOPIC, process, 1, now_ns)
            encoded = codec_of(Request).encode(request)
            batch = RecordWriter()
            batch.add(envelope, encoded)
            bus.publish_batch(process, batch.take())
            bus.publisher(Request.TOPIC, process).put(encoded, envelope.attachment())
            return _wait(acks, request, timeout_s)
    except zenoh.ZError as error:
        raise GroundStationError(f"the rig at {endpoint} does not let us in: {error}") from error


def _wait(acks: Listener, request: Request, timeout_s: float) -> Ack:
    until_s = time.monotonic() + timeout_s
    asked = (request.request_id, request.author, request.vehicle)
    while (left_s := until_s - time.monotonic()) > 0:
        delivered = acks.take(left_s)
        if delivered is None or not isinstance(delivered.payload, Ack):
            continue
        ack = delivered.payload
        if (ack.request_id, ack.author, ack.vehicle) == asked:
            return ack
    raise GroundStationError(f"{request.vehicle} did not answer within {timeout_s:g} s: is it starting?")
