"""The application around the screens: who is let in, pages, routes."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from importlib.resources import files

from fastapi import FastAPI, Request
from fastapi.responses import Response
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from groundstation.console.access import COOKIE, Role
from groundstation.console.api import add_api
from groundstation.console.body import HEADERS, LONGEST_BODY, refused
from groundstation.console.lease_api import add_lease
from groundstation.console.screen_socket import socket_of
from groundstation.console.shown_console import Console
from groundstation.console.wizard_api import add_wizard

PAGE = files("groundstation.console") / "page"
TYPES = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
    "txt": "text/plain; charset=utf-8",
}
MOST_DIGITS = 10
"""Of a length that is told."""


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
    add_api(app, console)
    add_lease(app, console)
    add_wizard(app, console)
    _add_pages(app)
    app.add_api_websocket_route("/ws", socket_of(console))
    return app


def _guard(app: FastAPI, console: Console) -> None:
    """Refuse what is foreign, too long, or nobody's, before any route sees it."""
    access = console.access

    @app.middleware("http")
    async def guard(request: Request, go_on: Callable[[Request], Awaitable[Response]]) -> Response:
        headers = {name.lower(): value for name, value in request.headers.items()}
        foreign = access.foreign(headers)
        if foreign:
            return refused(403, foreign)
        length = headers.get("content-length", "0")
        if not length.isdecimal() or len(length) > MOST_DIGITS or int(length) > LONGEST_BODY:
            return refused(413, f"a request has at most {LONGEST_BODY} bytes")
        token = request.query_params.get("token", "")
        role = access.role(headers, request.cookies.get(COOKIE, ""), token)
        is_known = bool(access.operator and token) and access.role({}, "", token) is not Role.NOBODY
        if role is Role.NOBODY:
            return refused(401, "this console wants a token: open the address that its run printed")
        if request.method == "POST" and role < Role.OPERATOR and request.url.path != "/api/stop":
            return refused(403, "an observer may look on and press STOP; the operator's address may ask")
        response = await go_on(request)
        response.headers.update(HEADERS)
        if is_known:  # a wrong one must not replace the right one of before
            secure = access.scheme == "https"
            response.set_cookie(COOKIE, token, httponly=True, samesite="strict", secure=secure)
        return response


def _add_pages(app: FastAPI) -> None:
    known = {
        entry.name: entry.read_bytes()
        for folder in (PAGE, PAGE / "vendor")
        for entry in folder.iterdir()
        if entry.is_file() and entry.name.rpartition(".")[2] in TYPES
    }

    @app.exception_handler(ClientDisconnect)
    async def nobody_waits(request: Request, error: ClientDisconnect) -> Response:
        del request, error
        return refused(400, "the connection ended before the request was whole")

    @app.exception_handler(HTTPException)
    async def nothing_there(request: Request, error: HTTPException) -> Response:
        path = request.url.path
        return refused(error.status_code, f"{request.method} {path!r:.60} is nothing that a console serves")

    @app.get("/")
    async def index() -> Response:
        return Response(known["index.html"], media_type=TYPES["html"])

    @app.get("/page/{name}")
    async def page(name: str) -> Response:
        data = known.get(name)
        if data is None:
            return refused(404, f"there is no page {name!r:.60}")
        return Response(data, media_type=TYPES[name.rpartition(".")[2]])
