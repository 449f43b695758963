"""Bridges and guests that cannot be had are refused in a sentence, before anything starts."""

import socket
from pathlib import Path

import pytest

from groundstation.bridges import foxglove
from groundstation.cli.run_beside import beside_of
from groundstation.declarations.errors import UsageError
from groundstation.launch.guests import DEFAULT_PORT, FILES

EXAMPLES = Path(__file__).parents[4] / "examples"
RIG, SCENARIO = EXAMPLES / "rigs" / "drawn_fixes.toml", EXAMPLES / "scenarios" / "go_to.toml"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((RIG, "--lockstep", "--duration", "1", "--foxglove"), "go with real time"),
        ((RIG, "--lockstep", "--duration", "1", "--ros2", "tcp/localhost:7447"), "go with real time"),
        ((RIG, "--ros2", "localhost"), "--ros2 is 'localhost', expected a router such as tcp/127.0.0.1:7447"),
        ((RIG, "--ros2", "serial/ttyS0:1"), "expected a router"),
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


def test_a_port_that_is_taken_is_named(monkeypatch, groundstation):
    monkeypatch.setattr(foxglove, "find_spec", lambda _name: object())
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(UsageError, match=f"port {port} of 127.0.0.1 is taken"):
            groundstation("run", RIG, "--foxglove", "--foxglove-port", port)


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
