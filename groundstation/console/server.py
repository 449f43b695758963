"""HTTP and WebSocket around the screens: pages, ``/api/``, and one socket each."""

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from typing import Any

from fastapi import FastAPI, Request, WebSocket, WebSocketDisconnect
from fastapi.responses import JSONResponse, Response
from starlette.exceptions import HTTPException

from groundstation.bus.fields import fields_of
from groundstation.console.access import COOKIE, Access, Role
from groundstation.console.body import LONGEST_BODY, body_of
from groundstation.console.chart_tap import UnknownFieldError
from groundstation.console.desk import Desk, LeaseOffice, NotAllowedError
from groundstation.console.hall import Hall, Screen
from groundstation.console.source import Source
from groundstation.console.wire import json_frame, plain
from groundstation.console.wizard_api import add_wizard
from groundstation.console.wizards import Wizards
from groundstation.declarations.request import ArgumentError
from groundstation.declarations.tables import Tables
from groundstation.recording.errors import RecordingError

PAGE = files("groundstation.console") / "page"
TYPES = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
    "txt": "text/plain; charset=utf-8",
}
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:; "
    "style-src 'self' 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}
LEASE_S = 600.0
MOST_S = 1e9
SOMEBODY = "console"
"""Who takes control without a name."""
MOST_SCREENS = 64
MOST_DIGITS = 10
"""Of a length that is told."""
NOT_LET_IN, TOO_MANY = 4401, 4429
"""Codes with which a socket is closed."""
HEADER = "x-lease-token"
Preview = Callable[[str, str, dict[str, object]], Awaitable[dict[str, Any]]]


class Console:
    """Everything that one server serves.

    Args:
        source: What is shown.
        tables: Of the rig.
        access: How it is reached.
        desk: Where requests are made; None where nothing can be asked for: a recording.
        preview: Flies a request in virtual time; None where that cannot be.
    """

    def __init__(
        self,
        source: Source,
        tables: Tables,
        access: Access,
        desk: Desk | None = None,
        preview: Preview | None = None,
    ) -> None:
        self.source = source
        self.tables = tables
        self.access = access
        self.desk = desk
        self.preview = preview
        self.hall = Hall(source, tables.payloads)
        self.office = None if desk is None else LeaseOffice(desk, self.holder)
        self.wizards: Wizards | None = None

    def lead(self, wizards: Wizards) -> None:
        """Let guided calibrations be led here."""
        self.wizards = wizards
        self.hall.greetings.append(wizards.frame)

    def holder(self) -> str:
        """Who holds control now; empty for nobody."""
        lease = self.hall.look().get("lease", {})
        return str(lease.get("holder", "")) if lease.get("left_s", 0.0) > 0.0 else ""

    def topics(self) -> list[dict[str, Any]]:
        """Every topic of the tables that something came of, with its numbers."""
        feed = self.source.feed
        found = []
        for noun, owner in sorted(feed.newest):
            kind = self.tables.payloads.get(noun)
            if kind is not None:
                numbers = [str(field) for field in fields_of(kind, owner)]
                found.append(
                    {
                        "topic": f"{owner or 'rig'}/{noun}",
                        "type": kind.ROS_TYPE,
                        "rate_hz": kind.TOPIC.rate_hz,
                        "count": feed.counts[noun, owner],
                        "fields": numbers,
                    }
                )
        return found


def make_app(console: Console) -> FastAPI:
    """The application of a console."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        del app
        running = [asyncio.create_task(console.hall.run())]
        if console.wizards is not None:
            running.append(asyncio.create_task(console.wizards.run()))
        yield
        for task in running:
            task.cancel()

    app = FastAPI(
        title="groundstation console", docs_url=None, redoc_url=None, openapi_url=None, lifespan=lifespan
    )
    _guard(app, console)
    _add_api(app, console)
    _add_lease(app, console)
    add_wizard(app, console, _token, _refused)
    _add_pages(app, console)
    app.add_api_websocket_route("/ws", _socket(console))
    return app


def _guard(app: FastAPI, console: Console) -> None:
    """Refuse what is foreign, too long, or nobody's, before any route sees it."""
    access = console.access

    @app.middleware("http")
    async def guard(request: Request, go_on: Callable[[Request], Awaitable[Response]]) -> Response:
        headers = {name.lower(): value for name, value in request.headers.items()}
        foreign = access.foreign(headers)
        if foreign:
            return _refused(403, foreign)
        length = headers.get("content-length", "0")
        if not length.isdecimal() or len(length) > MOST_DIGITS or int(length) > LONGEST_BODY:
            return _refused(413, f"a request has at most {LONGEST_BODY} bytes")
        token = request.query_params.get("token", "")
        role = access.role(headers, request.cookies.get(COOKIE, ""), token)
        is_known = bool(access.operator and token) and access.role({}, "", token) is not Role.NOBODY
        if role is Role.NOBODY:
            return _refused(401, "this console wants a token: open the address that its run printed")
        if request.method == "POST" and role < Role.OPERATOR and request.url.path != "/api/stop":
            return _refused(403, "an observer may look on and press STOP; the operator's address may ask")
        response = await go_on(request)
        response.headers.update(HEADERS)
        if is_known:  # a wrong one must not replace the right one of before
            secure = access.scheme == "https"
            response.set_cookie(COOKIE, token, httponly=True, samesite="strict", secure=secure)
        return response


def _add_api(app: FastAPI, console: Console) -> None:
    hall = console.hall

    @app.exception_handler(HTTPException)
    async def nothing_there(request: Request, error: HTTPException) -> Response:
        path = request.url.path
        return _refused(error.status_code, f"{request.method} {path!r:.60} is nothing that a console serves")

    @app.get("/api/state")
    async def state() -> Response:
        return JSONResponse(plain(hall.look()))

    @app.get("/api/rig")
    async def rig() -> Response:
        return JSONResponse(plain(console.source.page))

    @app.get("/api/topics")
    async def topics() -> Response:
        return JSONResponse(console.topics())

    @app.post("/api/stop")
    async def stop(request: Request) -> Response:
        if console.desk is None:
            return _refused(409, "this is a recording: there is nothing to stop")
        try:
            body = await body_of(request)
        except ValueError:
            body = {}  # whatever was posted, it was a press
        return JSONResponse(await _pressed(console, console.desk, body))

    @app.post("/api/request")
    async def ask(request: Request) -> Response:
        if console.desk is None or console.office is None:
            return _refused(409, "this is a recording: nothing can be asked for")
        try:
            body = await body_of(request)
            vehicle, action = str(body.get("vehicle", "")), str(body.get("action", ""))
            arguments = body.get("arguments") or {}
            if not isinstance(arguments, dict):
                raise ValueError("'arguments' is no JSON object")
            author = console.office.author(action, _token(request, body))
            if action == "stop":
                return JSONResponse({"reason": "", **await _pressed(console, console.desk, body)})
            accepted, reason = await console.desk.request(vehicle, action, arguments, author)
        except (ValueError, ArgumentError) as error:
            return _refused(400, str(error))
        except NotAllowedError as error:
            return _refused(403, str(error))
        return JSONResponse({"accepted": accepted, "reason": reason}, 200 if accepted else 409)

    @app.post("/api/marker")
    async def mark(request: Request) -> Response:
        if console.desk is None:
            return _refused(409, "this is a recording: it takes no more notes")
        try:
            console.desk.mark(str((await body_of(request)).get("text") or ""))
        except (ValueError, ArgumentError) as error:
            return _refused(400, str(error))
        return JSONResponse({"accepted": True, "reason": ""})

    @app.post("/api/preview")
    async def preview(request: Request) -> Response:
        if console.preview is None:
            return _refused(409, "this rig cannot be flown in virtual time: it has no emulated twin")
        try:
            body = await body_of(request)
            arguments = body.get("arguments") or {}
            if not isinstance(arguments, dict):
                raise ValueError("'arguments' is no JSON object")
            shown = await console.preview(
                str(body.get("vehicle", "")), str(body.get("action", "")), arguments
            )
        except (ValueError, ArgumentError) as error:
            return _refused(400, str(error))
        return JSONResponse(plain(shown))


def _add_lease(app: FastAPI, console: Console) -> None:
    @app.post("/api/lease")
    async def lease(request: Request) -> Response:
        office = console.office
        if office is None:
            return _refused(409, "this is a recording: there is no control to take")
        try:
            body = await body_of(request)
            token = _token(request, body)
            action = str(body.get("action", "take")).replace("-", "_").replace(" ", "_")
            if action == "take":
                name = str(body.get("name") or office.holder_of(token) or SOMEBODY).strip()
                for_s = body.get("for_s", LEASE_S)
                if isinstance(for_s, bool) or not isinstance(for_s, int | float) or abs(for_s) > MOST_S:
                    raise ValueError(f"for_s is {for_s!r:.40}, expected seconds")
                fresh = await office.take(name, token, float(for_s), str(body.get("force") or ""))
                return JSONResponse({"accepted": True, "token": fresh, "holder": name})
            if action in ("give_up", "give", "release"):
                await office.give(token)
                return JSONResponse({"accepted": True, "holder": ""})
            if action in ("pass_on", "pass"):
                to = str(body.get("to") or body.get("name") or "").strip()
                if not to:
                    raise ValueError("passing control on needs 'to', a name")
                await office.give(token, to)
                return JSONResponse({"accepted": True, "holder": to})
            raise ValueError(f"action is {action!r:.40}, expected take, give_up or pass_on")
        except (ValueError, ArgumentError) as error:
            return _refused(400, str(error))
        except NotAllowedError as error:
            return _refused(409, str(error))


def _add_pages(app: FastAPI, console: Console) -> None:
    del console
    known = {
        entry.name: entry.read_bytes()
        for folder in (PAGE, PAGE / "vendor")
        for entry in folder.iterdir()
        if entry.is_file() and entry.name.rpartition(".")[2] in TYPES
    }

    @app.get("/")
    async def index() -> Response:
        return Response(known["index.html"], media_type=TYPES["html"])

    @app.get("/page/{name}")
    async def page(name: str) -> Response:
        data = known.get(name)
        if data is None:
            return _refused(404, f"there is no page {name!r:.60}")
        return Response(data, media_type=TYPES[name.rpartition(".")[2]])


def _socket(console: Console) -> Callable[[WebSocket], Awaitable[None]]:
    async def serve(socket: WebSocket) -> None:
        headers = {name.lower(): value for name, value in socket.headers.items()}
        role = console.access.role(
            headers, socket.cookies.get(COOKIE, ""), socket.query_params.get("token", "")
        )
        if console.access.foreign(headers) or role is Role.NOBODY:
            await socket.close(NOT_LET_IN)
            return
        if len(console.hall.screens) >= MOST_SCREENS:
            await socket.close(TOO_MANY)
            return
        await socket.accept()
        screen = Screen(socket, may_command=role is Role.OPERATOR and console.desk is not None)
        console.hall.enter(screen)
        sending = asyncio.create_task(screen.client.send())
        try:
            with suppress(WebSocketDisconnect):  # the screen is gone
                while True:
                    message = await socket.receive()
                    if message["type"] == "websocket.disconnect":
                        break
                    _obey(console, screen, message.get("text"))
        finally:
            sending.cancel()
            console.hall.leave(screen)

    return serve


def _obey(console: Console, screen: Screen, text: str | None) -> None:
    """Do what a screen asks for; None is a frame of bytes, which is refused."""
    try:
        asked = _wish(text)
        what = asked.get("type")
        if what == "stop":
            if console.desk is None:
                screen.client.append(
                    json_frame({"type": "trouble", "text": "this is a recording: there is nothing to stop"})
                )
            else:
                pressed = _pressed(console, console.desk, asked)
                pressed.add_done_callback(lambda task: screen.client.append(_outcome(task)))
        elif what == "charts":
            names = asked.get("fields")
            if not isinstance(names, list):
                raise ValueError(f"fields is {names!r:.40}, expected a list of names")
            console.hall.show_charts(screen, tuple(str(name) for name in names))
        elif what == "camera":
            vehicle = str(asked.get("vehicle") or "")
            screen.camera = vehicle if vehicle in console.source.vehicles else ""
        elif what == "ping":
            screen.client.append(json_frame({"type": "pong", "at": asked.get("at")}))
        elif what == "replay":
            console.source.control(asked)
        else:
            raise ValueError(f"{what!r:.40} is nothing that a screen can ask for")
    except (UnknownFieldError, RecordingError) as error:
        screen.client.append(json_frame({"type": "trouble", "text": str(error)}))
    except (ValueError, RecursionError) as error:
        why = "it is nested too deeply" if isinstance(error, RecursionError) else error
        screen.client.append(json_frame({"type": "trouble", "text": f"not understood: {why}"}))


def _wish(text: str | None) -> dict[str, Any]:
    """The JSON object that a screen sent.

    Raises:
        ValueError: It is none.
    """
    try:
        asked = json.loads("" if text is None else text[:LONGEST_BODY])
    except ValueError:
        raise ValueError("expected a JSON object as text") from None
    if not isinstance(asked, dict):
        raise ValueError(f"expected a JSON object, found {type(asked).__name__}")
    return asked


def _pressed(console: Console, desk: Desk, asked: Mapping[str, object]) -> "asyncio.Task[dict[str, object]]":
    """Press the stop of a vehicle, or of all where none of this run is named."""
    vehicle = str(asked.get("vehicle") or "")
    return desk.press(vehicle if vehicle in console.source.vehicles else "", str(asked.get("tap") or ""))


def _outcome(pressed: "asyncio.Task[dict[str, object]]") -> bytes:
    """What a screen is sent when its press has been answered, or has not."""
    if pressed.cancelled() or pressed.exception() is not None:
        return json_frame({"type": "stop", "accepted": False, "not_confirmed": []})
    return json_frame({"type": "stop", **pressed.result()})


def _token(request: Request, body: dict[str, object]) -> str:
    """The lease's token: in the body, or in a header."""
    bearer = request.headers.get("authorization", "").removeprefix("Bearer ").strip()
    return str(body.get("token") or request.headers.get(HEADER) or bearer)


def _refused(status: int, reason: str) -> Response:
    return JSONResponse({"accepted": False, "reason": reason}, status, headers=HEADERS)
