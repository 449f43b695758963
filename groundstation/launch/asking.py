"""Requests to a running rig, and their answers."""

import getpass
import itertools
import json
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import zenoh

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.listener import Listener
from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import HubError, ZenohBus
from groundstation.declarations.errors import GroundStationError
from groundstation.declarations.message import Message
from groundstation.declarations.request import Ack, Request, Value
from groundstation.launch.running import find_running

_SEQUENCE = itertools.count(1)
"""Of all that this process publishes: a replay tells its messages apart by it."""


def operator() -> str:
    """What this process is called on the bus: a process of its own, as the recording sees it."""
    return f"operator_{os.getpid()}"


def user_name() -> str:
    """In whose name this process asks; a user whom the machine has no name for goes by his number."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return f"user {os.getuid()}"


def fresh_number() -> int:
    """A number that is unique per author: milliseconds of the monotonic clock, 32 bit."""
    return time.monotonic_ns() // 1_000_000 % 2**32


@contextmanager
def session_with(endpoint: str) -> Iterator[ZenohBus]:
    """A session with the hub of a run.

    Raises:
        GroundStationError: The hub is not there, goes away, or is paused: nobody would ever be let in.
    """
    for run in find_running():
        if run.endpoint == endpoint and run.is_paused:
            raise GroundStationError(
                f"{run.rig} is paused and takes nothing: let it go on by `kill -CONT {run.pid}`, "
                "or by `fg` where it was started"
            )
    try:
        with ZenohBus(endpoint) as bus:
            yield bus
    except (zenoh.ZError, HubError) as error:
        raise GroundStationError(f"the rig at {endpoint} does not let us in: {error}") from error


def publish(bus: ZenohBus, message: Message) -> None:
    """Publish a message of this process at once, and to the recorder."""
    topic = message.TOPIC
    envelope = Envelope(topic, operator(), next(_SEQUENCE), time.monotonic_ns())
    encoded = codec_of(type(message)).encode(message)
    bus.put(topic, operator(), encoded, envelope.attachment())
    batch = RecordWriter()
    batch.add(envelope, encoded)
    bus.publish_batch(operator(), batch.take())


def requests_of(
    vehicles: tuple[str, ...], action: str, arguments: Mapping[str, Value], author: str
) -> list[Request]:
    """The same request of several vehicles, each with a number of its own."""
    now_ns, first, text = time.monotonic_ns(), fresh_number(), json.dumps(dict(arguments))
    return [
        Request(now_ns, vehicle, (first + place) % 2**32, author, action, text)
        for place, vehicle in enumerate(vehicles)
    ]


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
    answers = ask_each(endpoint, (vehicle,), action, arguments, author, timeout_s)
    ack = answers.get(vehicle)
    if ack is None:
        raise GroundStationError(silence(vehicle, timeout_s))
    return ack


def ask_each(
    endpoint: str,
    vehicles: tuple[str, ...],
    action: str,
    arguments: Mapping[str, Value],
    author: str,
    timeout_s: float,
) -> dict[str, Ack]:
    """Ask the same of several vehicles at once; the answers that came in time, by vehicle.

    Raises:
        GroundStationError: The hub is not there.
    """
    with session_with(endpoint) as bus:
        acks = Listener(bus, (Ack,))
        waiting = {
            (request.request_id, request.author, request.vehicle): request
            for request in requests_of(vehicles, action, arguments, author)
        }
        for request in waiting.values():
            publish(bus, request)
        answers: dict[str, Ack] = {}
        until_s = time.monotonic() + timeout_s
        while waiting and (left_s := until_s - time.monotonic()) > 0:
            delivered = acks.take(left_s)
            if delivered is None or not isinstance(delivered.payload, Ack):
                continue
            ack = delivered.payload
            if waiting.pop((ack.request_id, ack.author, ack.vehicle), None) is not None:
                answers[ack.vehicle] = ack
        return answers


def silence(vehicle: str, timeout_s: float) -> str:
    """What is reported where nobody answers."""
    return f"{vehicle or 'nobody'} did not answer within {timeout_s:g} s: is it starting?"
