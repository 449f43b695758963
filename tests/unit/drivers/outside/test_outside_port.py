"""The edge to programs outside, by a hub and a client of Zenoh: stamps, bounded queues, answers."""

import json
import socket
import threading
import time

import pytest
import zenoh

from drivers.errors import NotFound
from drivers.outside.port import MOST_REQUESTS, MOST_WRENCHES, OutsidePort
from drivers.outside.protocol import LONGEST_BYTES
from groundstation.bus.zenoh_bus import open_hub


@pytest.fixture
def endpoint():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        found = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    hub = open_hub(found)
    yield found
    hub.close()


@pytest.fixture
def port(endpoint):
    made = OutsidePort(endpoint, ("alpha", "beta"))
    yield made
    made.close()


@pytest.fixture
def client(endpoint):
    """A client that sends what surely arrives."""
    config = {
        "mode": "client",
        "connect": {"endpoints": [endpoint]},
        "scouting": {"multicast": {"enabled": False}},
    }
    with zenoh.open(zenoh.Config.from_json5(json.dumps(config))) as session:
        yield session


def send(client, key, text):
    client.put(key, text, congestion_control=zenoh.CongestionControl.BLOCK)


def read_until(port, text):
    """All arrivals up to the one with this text."""
    found = []
    while not found or found[-1].text != text:
        arrivals = port.read(10.0)
        assert arrivals, "nothing came for ten seconds"
        found += arrivals
    return found


def test_a_text_comes_with_its_key_and_a_stamp_between_sending_and_reading(port, client):
    before_ns = time.monotonic_ns()
    send(client, "outside/alpha/wrench", b"hello")
    [arrival] = read_until(port, b"hello")
    assert (arrival.key, arrival.replaced) == ("outside/alpha/wrench", 0)
    assert before_ns < arrival.stamp_ns < time.monotonic_ns()


def test_whatever_is_not_read_the_newest_stay_and_the_rest_is_counted(port, client):
    for number in range(500):
        send(client, "outside/alpha/wrench", f"{number}")
        send(client, "outside/alpha/request", f"{number}")
    send(client, "outside/beta/request", b"last")  # one session: it comes behind all others
    while not any(queue.waiting for key, queue in port._queues.items() if "beta" in key):
        with port._news:
            port._news.wait(10.0)
    found = read_until(port, b"last")
    wrenches = [each for each in found if each.key == "outside/alpha/wrench"]
    requests = [each for each in found if each.key == "outside/alpha/request"]
    assert [each.text for each in wrenches] == [f"{n}".encode() for n in range(500 - MOST_WRENCHES, 500)]
    assert [each.text for each in requests] == [f"{n}".encode() for n in range(500 - MOST_REQUESTS, 500)]
    assert [each.replaced for each in wrenches] == [500 - MOST_WRENCHES, *[0] * (MOST_WRENCHES - 1)]


def test_a_megabyte_is_cut_and_a_vehicle_that_is_not_there_takes_no_room(port, client):
    for number in range(50):
        send(client, f"outside/nobody_{number}/wrench", b"x")
    send(client, f"outside/{'z' * 5000}/wrench", b"y")
    send(client, "outside/alpha/wrench", b"\0" * 1_000_000)
    found = []
    while not any(each.key == "outside/alpha/wrench" for each in found):
        found += port.read(10.0)
    assert len(found[-1].text) == LONGEST_BYTES + 1
    assert len(found) <= 53
    assert all(len(each.key) <= 100 for each in found)
    assert len(port._queues) == 5


def test_an_answer_reaches_the_client(port, client):
    taken, news = [], threading.Event()

    def take(sample):
        taken.append((str(sample.key_expr), sample.payload.to_string()))
        news.set()

    client.declare_subscriber("outside/alpha/answer", take)
    for _ in range(100):  # until the hub has passed the subscription on
        port.send("outside/alpha/answer", "{}")
        if news.wait(0.1):
            break
    assert taken[0] == ("outside/alpha/answer", "{}")


def test_waiting_ends_when_it_is_woken_and_nothing_comes_after_the_end(port):
    thread = threading.Thread(target=port.read, args=(60.0,))
    thread.start()
    port.wake()
    thread.join(10.0)
    assert not thread.is_alive()
    port.close()
    assert port.read(60.0) == []
    port.close()


def test_without_a_hub_there_is_one_sentence():
    with pytest.raises(NotFound, match=r"no hub answers at tcp/127\.0\.0\.1:1$"):
        OutsidePort("tcp/127.0.0.1:1", ("alpha",))
