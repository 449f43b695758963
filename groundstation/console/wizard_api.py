"""``/api/wizard``: what goes on; start, accept or discard a guided calibration, for whoever holds control."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse, Response

from groundstation.console.body import body_of
from groundstation.console.desk import NotAllowedError
from groundstation.console.wizards import asked_of
from groundstation.files.errors import FileError

if TYPE_CHECKING:
    from groundstation.console.server import Console

NEEDS_CONTROL = "go_to"
"""Who may send a vehicle somewhere may calibrate it."""


def add_wizard(
    app: FastAPI,
    console: "Console",
    token_of: Callable[[Request, dict[str, object]], str],
    refused: Callable[[int, str], Response],
) -> None:
    """Add the route.

    Args:
        app: To.
        console: Of.
        token_of: The lease's token in a request.
        refused: An answer with a reason.
    """

    @app.get("/api/wizard")
    async def shown() -> Response:
        if console.wizards is None:
            return refused(409, "this is a recording: nothing can be calibrated live")
        return JSONResponse(console.wizards.page())

    @app.post("/api/wizard")
    async def wizard(request: Request) -> Response:
        wizards, office = console.wizards, console.office
        if wizards is None or office is None:
            return refused(409, "this is a recording: nothing can be calibrated live")
        try:
            body = await body_of(request)
            action = asked_of(body)
            author = office.author(NEEDS_CONTROL, token_of(request, body))
            if action == "accept":
                return JSONResponse({"accepted": True, "reason": "", "files": await wizards.accept(author)})
            if action == "discard":
                wizards.discard(author)
            else:
                wizards.start(
                    str(body.get("name", "")),
                    str(body.get("vehicle", "")),
                    author,
                    is_driven=body.get("drive") is True,
                )
        except FileError as error:
            return refused(409, str(error))
        except ValueError as error:
            return refused(400, str(error))
        except NotAllowedError as error:
            return refused(403, str(error))
        return JSONResponse({"accepted": True, "reason": ""})
