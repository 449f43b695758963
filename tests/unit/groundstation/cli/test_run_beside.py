"""Bridges and guests that cannot be had are refused in a sentence, before anything starts."""

import socket
from pathlib import Path

import pytest

from groundstation.bridges import foxglove
from groundstation.cli.run_beside import beside_of
from groundstation.declarations.errors import UsageError
from groundstation.launch.guests import DEFAULT_PORT, FILES
from groundstation.launch.listening import check_listening

EXAMPLES = Path(__file__).parents[4] / "examples"
RIG, SCENARIO = EXAMPLES / "rigs" / "drawn_fixes.toml", EXAMPLES / "scenarios" / "go_to.toml"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((RIG, "--lockstep", "--duration", "1", "--foxglove"), "go with real time"),
        ((RIG, "--lockstep", "--duration", "1", "--ros2", "tcp/localhost:7447"), "go with real time"),
        ((RIG, "--ros2", "localhost"), "--ros2 is 'localhost', expected a router such as tcp/127.0.0.1:7447"),
        ((RIG, "--ros2", "serial/ttyS0:1"), "expected a router"),
        ((RIG, "--ros2", "tcp/127.0.0.1:99999"), "expected a router"),
        ((RIG, "--ros2", "tcp/127.0.0.1:0"), "expected a router"),
        ((RIG, "--ros2", "tcp/127.0.0.1:http"), "expected a router"),
        ((RIG, "--ros2", "tcp/127.0.0.1:"), "expected a router"),
        ((RIG, "--ros2", "tcp/:7447"), "expected a router"),
        ((RIG, "--ros2", "tcp/::1:7447"), "expected a router"),
        ((RIG, "--ros2", "tcp/two words:7447"), "expected a router"),
        ((RIG, "--ros2", "tcp/\udcff:7447"), "expected a router"),
        ((RIG, "--ros2", f"tcp/127.0.0.1:{'7' * 5000}"), "expected a router"),
        (
            (RIG, "--guests", "0.0.0.0", "--guests-certificates", "nowhere"),
            "nowhere/ca.pem is not there: make",
        ),
        ((RIG, "--guests", "0.0.0.0"), "--guests wants --guests-certificates"),
        ((RIG, "--guests", "0.0.0.0:99999"), "expected an address"),
        ((RIG, "--guests", ""), "expected an address"),
    ],
)
def test_what_makes_no_sense_is_refused(groundstation, words, sentence):
    with pytest.raises(UsageError) as refusal:
        groundstation("run", *words)
    assert sentence in str(refusal.value)


def test_a_missing_extra_is_named(monkeypatch, groundstation):
    monkeypatch.setattr(foxglove, "find_spec", lambda _name: None)
    with pytest.raises(UsageError, match=r"pip install 'groundstation\[foxglove\]'"):
        groundstation("run", RIG, "--foxglove")


@pytest.fixture
def taken():
    """A port of loopback on which somebody listens."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        yield listening.getsockname()[1]


@pytest.fixture
def certificates(tmp_path):
    folder = tmp_path / "certificates"
    folder.mkdir()
    for name in FILES:
        (folder / name).write_text("")
    return folder


def refused_before_anything_starts(groundstation, folder, *words):
    recording = folder / "run.mcap"
    with pytest.raises(UsageError) as refusal:
        groundstation("run", RIG, "--headless", "--no-console", "--record", recording, *words)
    assert not recording.exists()
    return str(refusal.value)


def test_a_port_of_foxglove_that_is_taken_is_named(monkeypatch, taken, groundstation):
    monkeypatch.setattr(foxglove, "find_spec", lambda _name: object())
    with pytest.raises(UsageError, match=f"port {taken} of 127.0.0.1 is taken: .* --foxglove-port"):
        groundstation("run", RIG, "--foxglove", "--foxglove-port", taken)


def test_a_hub_or_guests_that_cannot_be_listened_for_are_refused(
    taken, certificates, tmp_path, groundstation
):
    def sentence(*words):
        return refused_before_anything_starts(groundstation, tmp_path, *words)

    is_taken = f"port {taken} of 127.0.0.1 is taken: choose another with"
    assert sentence("--hub-port", taken) == f"{is_taken} --hub-port"
    guests = ("--guests-certificates", certificates, "--guests")
    assert sentence(*guests, f"127.0.0.1:{taken}") == f"{is_taken} --guests"
    for strange in ("192.0.2.1:7449", "[nonsense]:7449", "a..b"):
        assert "is no address of this machine" in sentence(*guests, strange)


def test_a_port_that_two_options_name_is_refused(monkeypatch, certificates, tmp_path, groundstation):
    free = check_listening("127.0.0.1", 0, "")
    monkeypatch.setattr(foxglove, "find_spec", lambda _name: object())
    words = ("--hub-port", free, "--foxglove", "--foxglove-port", free)
    sentence = refused_before_anything_starts(groundstation, tmp_path, *words)
    assert sentence == f"port {free} of 127.0.0.1 is taken: choose another with --foxglove-port"
    words = ("--hub-port", free, "--guests", f"127.0.0.1:{free}", "--guests-certificates", certificates)
    sentence = refused_before_anything_starts(groundstation, tmp_path, *words)
    assert sentence == f"port {free} of 127.0.0.1 is taken: choose another with --guests"


@pytest.mark.parametrize(
    "router", ["tcp/127.0.0.1:7447", "tcp/[::1]:7447", "tls/ros.lab:7447#root_ca_certificate=ca.pem"]
)
def test_routers_that_there_may_be_are_taken(router, tmp_path):
    assert beside_of(None, router, 0, None, tmp_path, is_live=True).bridges[0].options == (router, 0)


def test_nothing_runs_beside_a_rig_unless_it_is_asked_for(tmp_path):
    assert beside_of(None, None, 0, None, tmp_path, is_live=True) == ((), None)


@pytest.mark.parametrize(
    ("asked", "endpoint"),
    [
        ("0.0.0.0", f"tls/0.0.0.0:{DEFAULT_PORT}"),
        ("192.168.1.20:8000", "tls/192.168.1.20:8000"),
        ("::", f"tls/[::]:{DEFAULT_PORT}"),
        ("[::1]:8000", "tls/[::1]:8000"),
        ("[fe80::1]", f"tls/[fe80::1]:{DEFAULT_PORT}"),
    ],
)
def test_addresses_of_guests(tmp_path, asked, endpoint):
    for name in FILES:
        (tmp_path / name).write_text("")
    made = beside_of(None, "tcp/localhost:7447", 7, asked, tmp_path, is_live=True)
    assert made.guests.endpoint == endpoint
    assert [each.options for each in made.bridges] == [("tcp/localhost:7447", 7)]


def test_guests_join_no_scenario(tmp_path, groundstation):
    for name in FILES:
        (tmp_path / name).write_text("")
    with pytest.raises(UsageError, match="--guests goes with a rig"):
        groundstation("run", SCENARIO, "--guests", "127.0.0.1", "--guests-certificates", tmp_path)
