"""A program of another host beside a flight: an operator is answered, an observer only looks."""

import datetime
import json
import queue
import socket

import pytest
import zenoh

from groundstation.launch.certificates import make_all

pytestmark = pytest.mark.slow

PATIENCE_S = 60.0
ASKED = {"author": "anna", "id": 1, "action": "take_control", "arguments": {"for_s": 60.0}}


@pytest.fixture
def flight(launch, two_drawn, tmp_path):
    folder = tmp_path / "certificates"
    make_all(folder, (), datetime.datetime.now(datetime.UTC))
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    run = launch(two_drawn, "--guests", f"127.0.0.1:{port}", "--guests-certificates", str(folder))
    run.wait_until_flying()
    yield folder, f"tls/127.0.0.1:{port}"
    run.end_in_order()


def guest(folder, endpoint, role):
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "scouting/multicast/enabled": False,
        "transport/link/tls": {
            "root_ca_certificate": str(folder / "ca.pem"),
            "enable_mtls": True,
            "connect_certificate": str(folder / f"{role}.pem"),
            "connect_private_key": str(folder / f"{role}.key"),
        },
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def taking(session, key):
    came = queue.SimpleQueue()
    return came, session.declare_subscriber(key, zenoh.handlers.Callback(came.put, indirect=False))


def test_an_operator_is_answered_and_an_observer_is_not(flight):
    folder, endpoint = flight
    with guest(folder, endpoint, "operator") as operator, guest(folder, endpoint, "observer") as observer:
        states, _first = taking(observer, "alpha/state")
        answers, _second = taking(operator, "outside/alpha/answer")
        assert states.get(timeout=PATIENCE_S).payload
        observer.put("outside/alpha/request", json.dumps(ASKED | {"author": "bob"}))
        operator.put("outside/alpha/request", json.dumps(ASKED))
        answer = json.loads(answers.get(timeout=PATIENCE_S).payload.to_bytes())
        assert (answer["author"], answer["action"]) == ("anna", "take_control")
        assert answer["accepted"], answer["reason"]
