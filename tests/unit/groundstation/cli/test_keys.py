"""Keys of a run: space stops all, l lands all, q ends; the terminal is afterwards as it was before."""

import os
import socket
import termios
import threading
import tty

import pytest

from groundstation.bus.listener import Listener
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.cli.keys import Keys, stdin_descriptor
from groundstation.declarations.request import Request
from groundstation.parts.supervision.messages import StopPress


@pytest.fixture
def endpoint():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def terminal():
    keyboard, descriptor = os.openpty()
    yield keyboard, descriptor
    os.close(keyboard)
    os.close(descriptor)


def keys_on(descriptor, endpoint, end=lambda: None, note=lambda _line: None):
    return Keys(descriptor, endpoint, ("alpha", "beta"), "anna", note, end)


def test_each_space_is_a_fresh_press_for_all(endpoint, terminal):
    keyboard, descriptor = terminal
    with ZenohBus(endpoint, is_hub=True) as hub:
        presses = Listener(hub, (StopPress,))
        with keys_on(descriptor, endpoint) as keys:
            assert keys.are_read
            os.write(keyboard, b" ")
            first = presses.take(5.0).payload
            os.write(keyboard, b" ")
            ids = {first.press_id}
            while len(ids) < 2:
                ids.add(presses.take(5.0).payload.press_id)
    assert (first.vehicle, first.author) == ("", "anna")


def test_l_lands_every_vehicle_and_q_ends(endpoint, terminal):
    keyboard, descriptor = terminal
    asked = threading.Event()
    with ZenohBus(endpoint, is_hub=True) as hub:
        requests = Listener(hub, (Request,))
        with keys_on(descriptor, endpoint, asked.set):
            os.write(keyboard, b"xlQ")
            found = [requests.take(5.0).payload for _ in range(2)]
            assert asked.wait(5.0)
    assert [(request.vehicle, request.action) for request in found] == [("alpha", "land"), ("beta", "land")]
    assert len({request.request_id for request in found}) == 2


def test_the_terminal_is_as_before(endpoint, terminal):
    _, descriptor = terminal
    before = termios.tcgetattr(descriptor)
    with ZenohBus(endpoint, is_hub=True), keys_on(descriptor, endpoint):
        during = termios.tcgetattr(descriptor)
        assert not during[tty.LFLAG] & (termios.ICANON | termios.ECHO)
        assert during[tty.LFLAG] & termios.ISIG, "Ctrl-C goes on ending the run"
    assert termios.tcgetattr(descriptor) == before


def test_without_a_terminal_nothing_is_read(endpoint, monkeypatch):
    reading, writing = os.pipe()
    with keys_on(reading, endpoint) as keys:
        assert not keys.are_read
    os.close(reading)
    os.close(writing)
    monkeypatch.setattr("sys.stdin", None)
    with keys_on(stdin_descriptor(), endpoint) as keys:
        assert not keys.are_read


def test_a_hub_that_is_not_there_is_reported(endpoint, terminal):
    _, descriptor = terminal
    reported, lines = threading.Event(), []
    with keys_on(descriptor, endpoint, note=lambda line: (lines.append(line), reported.set())):
        assert reported.wait(20.0)
    assert lines[0].startswith("keys are not read any more: the rig at ")
