"""One WebSocket for each screen: what it is sent, and what it asks for."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from fastapi import WebSocket, WebSocketDisconnect

from groundstation.console.access import COOKIE, Role
from groundstation.console.body import LONGEST_BODY
from groundstation.console.chart_tap import UnknownFieldError
from groundstation.console.hall import Screen
from groundstation.console.shown_console import Console
from groundstation.console.wire import json_frame
from groundstation.recording.errors import RecordingError

MOST_SCREENS = 64
NOT_LET_IN, TOO_MANY = 4401, 4429
"""Codes with which a socket is closed."""


def socket_of(console: Console) -> Callable[[WebSocket], Awaitable[None]]:
    """Serves one screen after another."""

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
                pressed = console.press(console.desk, asked)
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


def _outcome(pressed: "asyncio.Task[dict[str, object]]") -> bytes:
    """What a screen is sent when its press has been answered, or has not."""
    if pressed.cancelled() or pressed.exception() is not None:
        return json_frame({"type": "stop", "accepted": False, "not_confirmed": []})
    return json_frame({"type": "stop", **pressed.result()})
