"""What is asked for at the console: of a vehicle, or of the rig, and never of nobody."""

import asyncio
import socket
from collections.abc import Iterator

import pytest

from groundstation.bus.cdr import codec_of
from groundstation.bus.zenoh_bus import ZenohBus, key_of
from groundstation.console.desk import Desk, NotAllowedError
from groundstation.console.tokens import Tokens
from groundstation.declarations.request import Request, answer
from groundstation.launch.asking import publish
from groundstation.parts.table import own_tables

ACTIONS = own_tables().actions
VEHICLES = ("alpha", "beta")


@pytest.fixture
def buses() -> Iterator[tuple[ZenohBus, ZenohBus]]:
    """A hub that accepts whatever it is asked for and says of whom, and a session with it."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with ZenohBus(endpoint, is_hub=True) as hub, ZenohBus(endpoint) as bus:

        def reply(key: str, payload: bytes, attachment: bytes) -> None:
            del key, attachment
            request = codec_of(Request).decode(payload)
            publish(hub, answer(request, 1, f"asked of {request.vehicle or 'the rig'}"))

        hub.subscribe(key_of(Request.TOPIC, "*"), reply)
        yield hub, bus


def ask(buses: tuple[ZenohBus, ZenohBus], vehicle: str, action: str) -> str:
    """Whom it was asked of in the end."""

    async def asked() -> str:
        _, bus = buses
        desk = Desk(bus, bus, VEHICLES, ACTIONS, Tokens(b"secret"))
        _, words = await desk.request(vehicle, action, {}, "anna")
        return words

    return asyncio.run(asked())


@pytest.mark.parametrize("action", [row.name for row in ACTIONS.values() if not row.is_of_rig])
def test_what_concerns_a_vehicle_needs_one(buses: tuple[ZenohBus, ZenohBus], action: str) -> None:
    with pytest.raises(NotAllowedError, match=f"^{action} needs a vehicle: one of alpha, beta$"):
        ask(buses, "", action)


@pytest.mark.parametrize("action", ["take_control", "give_control", "start_scenario"])
@pytest.mark.parametrize("vehicle", ["", "alpha"])
def test_what_concerns_the_rig_is_asked_of_it_whatever_vehicle_is_named(
    buses: tuple[ZenohBus, ZenohBus], vehicle: str, action: str
) -> None:
    assert ask(buses, vehicle, action) == "asked of the rig"


def test_what_concerns_a_vehicle_is_asked_of_that(buses: tuple[ZenohBus, ZenohBus]) -> None:
    assert ask(buses, "beta", "fly") == "asked of beta"


def test_a_vehicle_that_is_none_is_refused(buses: tuple[ZenohBus, ZenohBus]) -> None:
    with pytest.raises(NotAllowedError, match=r"there is no vehicle 'gamma' \(there are alpha, beta\)"):
        ask(buses, "gamma", "fly")
