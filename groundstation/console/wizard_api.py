"""``/api/wizard``: what goes on; start, accept or discard a guided calibration, for whoever holds control."""

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse, Response

from groundstation.console.body import body_of, refused, text_of, token_of
from groundstation.console.desk import NotAllowedError
from groundstation.console.shown_console import Console
from groundstation.console.wizards import asked_of
from groundstation.files.errors import FileError

NEEDS_CONTROL = "go_to"
"""Who may send a vehicle somewhere may calibrate it."""


def add_wizard(app: FastAPI, console: Console) -> None:
    """Add the routes."""

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
            author = await office.author(NEEDS_CONTROL, token_of(request, body))
            if action == "accept":
                return JSONResponse({"accepted": True, "reason": "", "files": await wizards.accept(author)})
            if action == "discard":
                wizards.discard(author)
            else:
                wizards.start(
                    text_of(body, "name"),
                    text_of(body, "vehicle"),
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
