"""Presses of the stop: repeated until every vehicle has taken them, whoever waits for that or does not."""

import math
import socket
import time

import pytest

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.launch.stop_button import StopButton
from groundstation.parts.supervision.messages import Supervision

LONGEST_S = 20.0


@pytest.fixture
def endpoint():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


def ruling(vehicle: str) -> Supervision:
    return Supervision(
        time.monotonic_ns(), vehicle, "braking", "brake", True, True, True, math.inf, False, 1, "stop",
        "anna", time.monotonic_ns(), (), (),
    )  # fmt: skip


@pytest.mark.parametrize("timeout_s", [0.0, 0.05])
def test_it_is_pending_until_each_vehicle_has_taken_it(endpoint, timeout_s):
    with ZenohBus(endpoint, is_hub=True) as hub, ZenohBus(endpoint) as bus:
        button = StopButton(bus, ("alpha", "beta"), "anna")
        press = button.press(timeout_s=LONGEST_S)
        begin_s = time.monotonic()
        sequence = 0
        while button.is_pending:
            assert time.monotonic() - begin_s < LONGEST_S
            sequence += 1
            for name in ("alpha",) if sequence < 5 else ("alpha", "beta"):
                message = ruling(name)
                envelope = Envelope(Supervision.TOPIC, name, sequence, message.stamp_ns)
                encoded = codec_of(Supervision).encode(message)
                hub.put(Supervision.TOPIC, name, encoded, envelope.attachment())
            button.follow(timeout_s)
            if sequence < 5:
                assert "beta" in press.waiting
    assert set(press.stopped) == {"alpha", "beta"}
    assert not press.waiting
