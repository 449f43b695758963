"""A topic's own key behind a hub: fed at once and in full while somebody subscribes, and never otherwise."""

import queue
import socket

import pytest

from groundstation.bus import zenoh_bus
from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.zenoh_bus import RECORD, ZenohBus, key_of
from groundstation.parts.control.messages import Wrench
from groundstation.recording.policy import ImagePolicy
from groundstation.runners.live_outlets import LiveOutlets

KEY = key_of(Wrench.TOPIC, "alpha")
WITHIN_S = 10.0


@pytest.fixture
def hub():
    """The hub, and where it is."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with ZenohBus(endpoint, is_hub=True) as bus:
        yield bus, endpoint


@pytest.fixture
def flight(hub):
    """Session of a process that publishes."""
    with ZenohBus(hub[1]) as bus:
        yield bus


@pytest.fixture
def outsider(hub):
    """Session of somebody who is no process of the rig."""
    with ZenohBus(hub[1]) as bus:
        yield bus


@pytest.fixture
def changes(monkeypatch):
    """Whether a publisher has subscribers, each time that it is told so, after it has taken note."""
    found = queue.SimpleQueue()
    match = zenoh_bus.TopicPublisher._match

    def seen(publisher, status):
        match(publisher, status)
        found.put(status.matching)

    monkeypatch.setattr(zenoh_bus.TopicPublisher, "_match", seen)
    return found


@pytest.fixture
def outlets(flight):
    return LiveOutlets(flight, "flight", ImagePolicy.OFF, lambda: None)


def subscribe(bus, key):
    """Keys and payloads of what comes, as a queue."""
    came = queue.SimpleQueue()
    bus.subscribe(key, lambda key, payload, _: came.put((key, payload)))
    return came


def published(outlets, count):
    """Send wrenches; their encoded payloads."""
    encoded = []
    for number in range(count):
        wrench = Wrench(number, "alpha", 0.1 * number, 0.0, 0.0, 0.0, 0.0, 0.0)
        outlets.send(Delivered(Envelope(Wrench.TOPIC, "alpha", number + 1, number), wrench))
        encoded.append(codec_of(Wrench).encode(wrench))
    return encoded


def test_whoever_subscribes_gets_every_message_at_once_and_none_is_sent_when_he_is_gone(
    monkeypatch, changes, outlets, outsider
):
    monkeypatch.setattr(zenoh_bus, "SUBSCRIBERS_KNOWN_NS", 0)
    puts = []
    put = zenoh_bus.TopicPublisher.put
    monkeypatch.setattr(zenoh_bus.TopicPublisher, "put", lambda p, *a: (puts.append(a[0]), put(p, *a)))
    published(outlets, 3)  # nobody subscribes
    assert not puts
    came = subscribe(outsider, KEY)
    assert changes.get(timeout=WITHIN_S)
    sent = published(outlets, 500)  # no flush of the record stream in between
    assert [came.get(timeout=WITHIN_S) for _ in sent] == [(KEY, payload) for payload in sent]
    assert puts == sent
    outsider.close()
    assert not changes.get(timeout=WITHIN_S)
    published(outlets, 3)
    assert puts == sent


def test_the_first_message_of_a_publisher_reaches_a_subscriber_whom_the_hub_has_not_reported_yet(
    monkeypatch, hub, outlets, outsider
):
    monkeypatch.setattr(zenoh_bus.TopicPublisher, "_match", lambda *_: None)  # the report never comes
    at_hub = subscribe(hub[0], f"{RECORD}/*")
    came = subscribe(outsider, KEY)
    outsider.publish_batch("outsider", b"")
    at_hub.get(timeout=WITHIN_S)  # so has what was declared before it
    sent = published(outlets, 1)
    assert came.get(timeout=WITHIN_S) == (KEY, sent[0])


def test_a_mailbox_keeps_the_newest_in_order_until_it_is_looked_into(hub, flight):
    mailbox = hub[0].collect(f"{RECORD}/*", 3)
    all_of_it = subscribe(hub[0], f"{RECORD}/*")
    assert mailbox.take() == []
    for number in range(5):
        flight.publish_batch("flight", bytes([number]))
    for _ in range(5):
        all_of_it.get(timeout=WITHIN_S)
    after = subscribe(hub[0], "after/all")  # served when everybody was served all that came before
    flight._session.put("after/all", b"")
    after.get(timeout=WITHIN_S)
    found = mailbox.take()
    assert len(found) == 3
    assert found == [(f"{RECORD}/flight", bytes([number])) for number in (2, 3, 4)]
    assert mailbox.take() == []
