"""The server without a flight: what it serves, what it refuses."""

import json
import time

import pytest
from fastapi.testclient import TestClient
from oracles.hand_fed_console import HandSource, batch_of, state_of

from groundstation.console.access import Access
from groundstation.console.server import make_app
from groundstation.console.shown_console import Console
from groundstation.declarations.rig import Rig


def test_the_page_and_all_that_it_names_come_from_here(served: TestClient) -> None:
    page = served.get("/")
    assert page.status_code == 200
    assert "http://" not in page.text.replace("http://www.w3.org", "")
    assert "https://" not in page.text
    names = {part.split('"')[0] for part in page.text.split('"/page/')[1:]}
    assert {"console.css", "main.js", "uPlot.iife.min.js"} <= names
    total = len(page.content)
    for name in names | {"link.js", "table.js", "charts.js", "operation.js", "stop.js"}:
        found = served.get(f"/page/{name}")
        assert found.status_code == 200, name
        total += len(found.content)
    assert total < 400_000


def test_the_state_is_json_with_ages(served: TestClient, source: HandSource) -> None:
    now_ns = time.monotonic_ns()
    source.feed.take_batch(batch_of([state_of("alpha", now_ns, x_m=0.25)]), now_ns)
    found = served.get("/api/state").json()
    alpha, beta = found["vehicles"]["alpha"], found["vehicles"]["beta"]
    assert alpha["x_m"] == 0.25
    assert 0 <= alpha["age_s"] < 60
    assert beta["age_s"] is None


def test_numbers_that_json_has_not_are_null(served: TestClient, source: HandSource) -> None:
    source.feed.take_batch(batch_of([state_of("alpha", 1, x_m=float("nan"))]), 1)
    text = served.get("/api/state").text
    assert "NaN" not in text
    assert json.loads(text)["vehicles"]["alpha"]["x_m"] is None


def test_topics_are_listed_with_their_numbers(served: TestClient, source: HandSource) -> None:
    source.feed.take_batch(batch_of([state_of("alpha", 1)]), 1)
    topics = served.get("/api/topics").json()
    assert topics[0]["topic"] == "alpha/state"
    assert "alpha/state.position_table_m[1]" in topics[0]["fields"]


@pytest.mark.parametrize(
    "headers",
    [{"host": "evil.example"}, {"origin": "http://evil.example"}, {"sec-fetch-site": "cross-site"}],
)
@pytest.mark.parametrize(
    ("method", "path"), [("GET", "/api/state"), ("POST", "/api/stop"), ("POST", "/api/request")]
)
def test_foreign_pages_get_nothing(
    served: TestClient, headers: dict[str, str], method: str, path: str
) -> None:
    found = served.request(method, path, headers=headers)
    assert found.status_code == 403
    assert found.json()["reason"]


def test_nothing_can_be_asked_of_what_has_no_desk(served: TestClient) -> None:
    for path in ("/api/stop", "/api/request", "/api/lease", "/api/marker", "/api/preview"):
        found = served.post(path, json={})
        assert (found.status_code, found.json()["accepted"]) == (409, False)


def test_a_body_that_is_too_long_is_refused(served: TestClient) -> None:
    assert served.post("/api/request", content=b"x" * 200_000).status_code == 413


def test_an_observer_may_look_and_not_ask(rig: Rig, source: HandSource) -> None:
    access = Access("192.168.1.5", 8400, (), "looks", "flies", "a.pem", "a.key")
    app = make_app(Console(source, rig.tables, access))
    with TestClient(app, base_url="https://192.168.1.5:8400") as client:
        assert client.get("/api/state").status_code == 401
        assert client.get("/api/state", params={"token": "looks"}).status_code == 200
        assert client.get("/api/state").status_code == 200  # the cookie
        assert client.post("/api/request", json={}).status_code == 403
        assert client.post("/api/stop").status_code == 409  # would be pressed, were there a desk


def test_a_screen_is_sent_the_rig_events_and_states(served: TestClient, source: HandSource) -> None:
    source.feed.take_batch(batch_of([state_of("alpha", time.monotonic_ns())]), 1)
    with served.websocket_connect("ws://127.0.0.1:8400/ws") as socket:
        first = socket.receive_bytes()
        assert first[:1] == b"J"
        hello = json.loads(first[1:])
        assert hello["type"] == "rig"
        assert set(hello["rig"]["vehicles"]) == {"alpha", "beta"}
        assert not hello["may_command"]
        state = json.loads(socket.receive_bytes()[1:])
        assert state["type"] == "state"
        socket.send_text(json.dumps({"type": "charts", "fields": ["alpha/state.heading_rad"]}))
        socket.send_text("no json")
        socket.send_text(json.dumps({"type": "charts", "fields": ["alpha/state.no_such"]}))
        troubles = []
        while len(troubles) < 2:
            frame = socket.receive_bytes()
            if frame[:1] == b"J" and (message := json.loads(frame[1:]))["type"] == "trouble":
                troubles.append(message["text"])
        assert "not understood" in troubles[0]
        assert "no_such" in troubles[1]


def test_a_foreign_screen_is_closed(served: TestClient) -> None:
    from starlette.websockets import WebSocketDisconnect

    with (
        pytest.raises(WebSocketDisconnect),
        served.websocket_connect("ws://127.0.0.1:8400/ws", headers={"origin": "http://evil.example"}),
    ):
        pass


def test_what_is_posted_in_pieces_is_bounded_too(rig: Rig, source: HandSource) -> None:
    def pieces():
        for _ in range(300):
            yield b"x" * 1000

    async def none(vehicle: str, action: str, arguments: dict[str, object]) -> dict[str, object]:
        raise AssertionError((vehicle, action, arguments))

    app = make_app(Console(source, rig.tables, Access(), preview=none))
    with TestClient(app, base_url="http://127.0.0.1:8400") as client:
        found = client.post("/api/preview", content=pieces())
        assert found.status_code == 400
        assert "at most" in found.json()["reason"]
        for wrong in (b"[1]", b"nonsense", b"[" * 50_000, b'{"arguments": 3}'):
            assert client.post("/api/preview", content=wrong).status_code == 400


def test_screens_are_a_bounded_number(served: TestClient) -> None:
    from contextlib import ExitStack

    from starlette.websockets import WebSocketDisconnect

    with ExitStack() as stack:
        for _ in range(64):
            stack.enter_context(served.websocket_connect("ws://127.0.0.1:8400/ws"))
        with pytest.raises(WebSocketDisconnect) as closed:
            stack.enter_context(served.websocket_connect("ws://127.0.0.1:8400/ws"))
        assert closed.value.code == 4429
    with served.websocket_connect("ws://127.0.0.1:8400/ws") as socket:
        assert socket.receive_bytes()


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [("GET", "/api/nothing", 404), ("PUT", "/api/state", 405), ("GET", "/ws", 404)],
)
def test_what_is_not_served_is_refused_with_a_reason(
    served: TestClient, method: str, path: str, status: int
) -> None:
    found = served.request(method, path)
    assert (found.status_code, found.json()["accepted"]) == (status, False)
    assert found.json()["reason"]


@pytest.mark.parametrize("token", ["%E2%82%AC", "%ff", "%00", "guessed"])
def test_a_wrong_token_is_neither_an_error_nor_kept(
    rig: Rig, source: HandSource, served: TestClient, token: str
) -> None:
    found = served.get(f"/api/state?token={token}")
    assert (found.status_code, "set-cookie" in found.headers) == (200, False)
    access = Access("192.168.1.5", 8400, (), "looks", "flies", "a.pem", "a.key")
    app = make_app(Console(source, rig.tables, access))
    with TestClient(app, base_url="https://192.168.1.5:8400") as client:
        assert client.get("/api/state?token=flies").status_code == 200
        assert client.get(f"/api/state?token={token}").status_code == 200
        assert client.get("/api/state").status_code == 200  # by the cookie of before


def test_a_length_of_thousands_of_digits_is_refused(served: TestClient) -> None:
    found = served.post("/api/stop", content=b"{}", headers={"content-length": "9" * 5000})
    assert found.status_code == 413


@pytest.mark.parametrize(
    "wish",
    [
        b"\x00\xff",
        "",
        "null",
        "[]",
        "{}",
        '{"type":"charts"}',
        '{"type":"charts","fields":"alpha/state.heading_rad"}',
        '{"type":"ping","at":' + "[" * 20_000 + "]" * 20_000 + "}",
        '{"type":"stop"}',
    ],
)
def test_what_a_screen_cannot_ask_for_is_answered_and_leaves_it_open(
    served: TestClient, wish: str | bytes
) -> None:
    with served.websocket_connect("ws://127.0.0.1:8400/ws") as socket:
        if isinstance(wish, bytes):
            socket.send_bytes(wish)
        else:
            socket.send_text(wish)
        socket.send_text('{"type":"ping","at":1}')
        answers: list[str] = []
        while "pong" not in answers:
            message = json.loads(socket.receive_bytes()[1:])
            if message["type"] in ("trouble", "pong"):
                answers.append(message["type"])
                assert "subscriptable" not in message.get("text", "")
        assert answers == ["trouble", "pong"]


def test_a_step_that_fails_does_not_end_what_screens_are_sent(
    served: TestClient, source: HandSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails() -> dict[str, object]:
        raise RuntimeError("it cannot be read")

    with served.websocket_connect("ws://127.0.0.1:8400/ws") as socket:
        monkeypatch.setattr(source, "extra", fails)
        while json.loads(socket.receive_bytes()[1:])["type"] != "trouble":
            pass
        monkeypatch.undo()
        while json.loads(socket.receive_bytes()[1:])["type"] != "state":
            pass
