"""What is posted is of the type that is asked for, or refused by its key; a silent connection is closed."""

import asyncio
import json

import pytest
from oracles.hand_fed_console import HandSource

from groundstation.console import impatient
from groundstation.console.access import Access
from groundstation.console.body import arguments_of, text_of
from groundstation.console.serving import server_of
from groundstation.console.shown_console import Console
from groundstation.declarations.rig import Rig

WRONG = [5, 1.5, True, [], {}, ["a"]]


@pytest.mark.parametrize("given", WRONG)
def test_a_text_is_text(given: object) -> None:
    with pytest.raises(ValueError, match=r"name is .*, expected text"):
        text_of({"name": given}, "name")


def test_what_is_left_out_is_empty() -> None:
    assert text_of({}, "name") == text_of({"name": None}, "name") == ""
    assert arguments_of({}) == arguments_of({"arguments": None}) == {}


@pytest.mark.parametrize("given", [0, [], "", False, "x"])
def test_arguments_are_an_object(given: object) -> None:
    with pytest.raises(ValueError, match=r"arguments is .*, expected a JSON object"):
        arguments_of({"arguments": given})


HEAD = b"POST /api/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 500\r\n\r\n"
WHOLE = b"GET /api/state HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


@pytest.mark.parametrize("sent", [b"", b"GET / HT", HEAD, HEAD + b"{", WHOLE, WHOLE + b"GET /api"])
def test_a_connection_that_asks_for_nothing_is_closed(
    rig: Rig,
    source: HandSource,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    sent: bytes,
) -> None:
    monkeypatch.setattr(impatient, "PATIENCE_S", 0.05)

    async def try_it() -> bytes:
        server = server_of(Console(source, rig.tables, Access(port=0)))
        serving = asyncio.create_task(server.serve())
        while not server.started:
            await asyncio.sleep(0)
        reader, writer = await asyncio.open_connection(*server.servers[0].sockets[0].getsockname())
        writer.write(sent)
        async with asyncio.timeout(20):
            answer = await reader.read()  # until it is closed
        writer.close()
        server.should_exit = True
        await serving
        return answer

    answer = asyncio.run(try_it())
    assert b"Traceback" not in capfd.readouterr().err.encode()
    if sent.startswith(WHOLE):
        assert json.loads(answer.partition(b"\r\n\r\n")[2])["vehicles"]
