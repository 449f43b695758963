"""One request to a running rig, and its answer."""

import os
import queue
import time

import zenoh

from groundstation.bus.envelope import Envelope
from groundstation.bus.topics import topic_of
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.messages.cdr import CodecError
from groundstation.messages.definitions import Ack, Request
from groundstation.runtime.errors import GroundStationError


def ask(
    endpoint: str, vehicle: str, action: str, numbers: tuple[float, ...], author: str, timeout_s: float
) -> Ack:
    """Publish a request and wait for its ack.

    Args:
        endpoint: Of the hub.
        vehicle: Of whom it is asked.
        action: A row of the table of actions.
        numbers: Its arguments, SI and radians.
        author: Who asks.
        timeout_s: How long to wait.

    Raises:
        GroundStationError: The hub is not there, or nobody answers in time.
    """
    heard: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    now_ns = time.monotonic_ns()
    number = now_ns // 1_000_000 % 2**32  # unique per author
    request = Request(now_ns, vehicle, number, author, action, numbers)
    topic = topic_of(Request)
    try:
        with ZenohBus(endpoint) as bus:
            bus.subscribe(f"*/{topic_of(Ack).noun}", lambda _key, data, _attachment: heard.put(data))
            # a process of its own, as the recording sees it
            envelope = Envelope(topic, f"operator_{os.getpid()}", 1, now_ns)
            bus.publish(envelope, topic.codec.encode(request))
            return _wait(heard, request, timeout_s)
    except zenoh.ZError as error:
        raise GroundStationError(f"the rig at {endpoint} does not let us in: {error}") from error


def _wait(heard: queue.SimpleQueue[bytes], request: Request, timeout_s: float) -> Ack:
    until_s = time.monotonic() + timeout_s
    while (left_s := until_s - time.monotonic()) > 0:
        try:
            ack = topic_of(Ack).codec.decode(heard.get(timeout=left_s))
        except (queue.Empty, CodecError):
            continue
        assert isinstance(ack, Ack)
        if (ack.request_id, ack.author, ack.vehicle) == (request.request_id, request.author, request.vehicle):
            return ack
    raise GroundStationError(f"{request.vehicle} did not answer within {timeout_s:g} s: is it starting?")
