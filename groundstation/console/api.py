"""``/api/``: what is shown, as JSON; requests, the stop, notes, goals flown ahead."""

import asyncio

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse, Response
from starlette.requests import ClientDisconnect

from groundstation.console.body import arguments_of, body_of, refused, text_of, token_of
from groundstation.console.desk import NotAllowedError
from groundstation.console.shown_console import Console
from groundstation.console.wire import plain
from groundstation.declarations.request import ArgumentError

BODY_S = 0.5
"""A stop waits for what is posted with it no longer."""


def add_api(app: FastAPI, console: Console) -> None:
    """Add the routes."""
    hall = console.hall

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
            return refused(409, "this is a recording: there is nothing to stop")
        try:
            async with asyncio.timeout(BODY_S):
                body = await body_of(request)
        except (ValueError, TimeoutError, ClientDisconnect):
            body = {}  # whatever was posted, or was to come, it was a press
        return JSONResponse(await console.press(console.desk, body))

    @app.post("/api/request")
    async def ask(request: Request) -> Response:
        if console.desk is None or console.office is None:
            return refused(409, "this is a recording: nothing can be asked for")
        try:
            body = await body_of(request)
            vehicle, action, arguments = text_of(body, "vehicle"), text_of(body, "action"), arguments_of(body)
            author = await console.office.author(action, token_of(request, body))
            if action == "stop":
                return JSONResponse({"reason": "", **await console.press(console.desk, body)})
            accepted, reason = await console.desk.request(vehicle, action, arguments, author)
        except (ValueError, ArgumentError) as error:
            return refused(400, str(error))
        except NotAllowedError as error:
            return refused(403, str(error))
        return JSONResponse({"accepted": accepted, "reason": reason}, 200 if accepted else 409)

    @app.post("/api/marker")
    async def mark(request: Request) -> Response:
        if console.desk is None:
            return refused(409, "this is a recording: it takes no more notes")
        try:
            console.desk.mark(text_of(await body_of(request), "text"))
        except (ValueError, ArgumentError) as error:
            return refused(400, str(error))
        return JSONResponse({"accepted": True, "reason": ""})

    @app.post("/api/preview")
    async def preview(request: Request) -> Response:
        if console.desk is None and console.preview is None:
            return refused(409, "this is a recording: nothing can be flown ahead")
        if console.preview is None:
            return refused(409, "this rig cannot be flown in virtual time: it has no emulated twin")
        try:
            body = await body_of(request)
            vehicle, action, arguments = text_of(body, "vehicle"), text_of(body, "action"), arguments_of(body)
            shown = await console.preview(vehicle, action, arguments)
        except (ValueError, ArgumentError) as error:
            return refused(400, str(error))
        return JSONResponse(plain(shown))
