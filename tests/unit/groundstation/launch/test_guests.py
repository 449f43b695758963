"""Other hosts on the bus, as Zenoh clients that are not ours: who gets in, and what each may do."""

import datetime
import json
import queue
import socket
import time

import pytest
import zenoh

from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.declarations.errors import UsageError
from groundstation.launch.certificates import make_all
from groundstation.launch.guests import OBSERVER, OPERATOR, Guests

PATIENCE_S = 5.0


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("certificates")
    make_all(made, (), datetime.datetime.now(datetime.UTC))
    return made


@pytest.fixture
def hub(folder):
    guests = Guests("127.0.0.1", free_port(), folder)
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with ZenohBus(endpoint, is_hub=True, also_at=(guests.endpoint,), settings=guests.settings()):
        yield endpoint, guests


def guest(hub, folder, name):
    """A session as another host would open it; without a name, without a certificate."""
    config = zenoh.Config()
    tls = {"root_ca_certificate": str(folder / "ca.pem")}
    if name:
        tls |= {
            "enable_mtls": True,
            "connect_certificate": str(folder / f"{name}.pem"),
            "connect_private_key": str(folder / f"{name}.key"),
        }
    for key, value in {
        "mode": "client",
        "connect/endpoints": [hub[1].endpoint],
        "scouting/multicast/enabled": False,
        "transport/link/tls": tls,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def passes(sender, receiver, key):
    """Whether what one puts reaches the other; the two are told of each other first."""
    came = queue.SimpleQueue()
    subscriber = receiver.declare_subscriber(key, zenoh.handlers.Callback(came.put, indirect=False))
    publisher = sender.declare_publisher(key)
    until_s = time.monotonic() + (PATIENCE_S if publisher.matching_status.matching else 1.0)
    try:
        while time.monotonic() < until_s:
            publisher.put(b"x")
            try:
                came.get(timeout=0.05)
            except queue.Empty:
                continue
            return True
        return False
    finally:
        publisher.undeclare()
        subscriber.undeclare()


@pytest.fixture
def local(hub):
    """A process of this host."""
    bus = ZenohBus(hub[0])
    yield bus._session
    bus.close()


def test_processes_of_this_host_do_as_before(hub, local):
    other = ZenohBus(hub[0])
    for key in ("alpha/state", "record/alpha_flight", "alpha/valve_command"):
        assert passes(local, other._session, key)
    other.close()


@pytest.mark.parametrize("role", [OBSERVER, OPERATOR])
def test_a_guest_receives_everything(hub, local, folder, role):
    with guest(hub, folder, role) as session:
        for key in ("alpha/state", "record/alpha_flight"):
            assert passes(local, session, key)


def test_an_observer_publishes_nothing(hub, local, folder):
    with guest(hub, folder, OBSERVER) as session:
        for key in ("outside/alpha/wrench", "operator_1/request", "alpha/state"):
            assert not passes(session, local, key)


@pytest.mark.parametrize(
    ("key", "may"),
    [
        ("outside/alpha/wrench", True),
        ("outside/alpha/request", True),
        ("operator_17/request", True),
        ("operator_17/stop_press", True),
        ("record/operator_17", True),
        ("alpha/state", False),
        ("alpha/supervision", False),
        ("alpha/valve_command", False),
        ("record/commands", False),
        ("commands/request", False),
    ],
)
def test_an_operator_commands_as_from_outside_and_no_further(hub, local, folder, key, may):
    with guest(hub, folder, OPERATOR) as session:
        assert passes(session, local, key) == may


def test_nobody_gets_in_without_a_certificate_of_ours(hub, folder, tmp_path):
    with pytest.raises(zenoh.ZError):
        guest(hub, folder, "")
    make_all(tmp_path / "others", (), datetime.datetime.now(datetime.UTC))
    for name in ("ca.pem",):
        (tmp_path / "others" / name).write_bytes((folder / name).read_bytes())
    with pytest.raises(zenoh.ZError):
        guest(hub, tmp_path / "others", OPERATOR)


def test_a_missing_file_is_named_before_anything_starts(tmp_path):
    with pytest.raises(UsageError, match=r"ca\.pem is not there: make it with `groundstation certificates"):
        Guests("0.0.0.0", 7449, tmp_path).check()


def test_addresses_of_both_families_become_endpoints(tmp_path):
    assert Guests("0.0.0.0", 7449, tmp_path).endpoint == "tls/0.0.0.0:7449"
    assert Guests("::", 7449, tmp_path).endpoint == "tls/[::]:7449"
