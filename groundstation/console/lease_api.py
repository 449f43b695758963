"""``/api/lease``: take control, give it up, pass it on."""

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse, Response

from groundstation.console.body import body_of, refused, text_of, token_of
from groundstation.console.desk import NotAllowedError
from groundstation.console.shown_console import Console
from groundstation.declarations.request import ArgumentError

LEASE_S = 600.0
MOST_S = 1e9
SOMEBODY = "console"
"""Who takes control without a name."""


def add_lease(app: FastAPI, console: Console) -> None:
    """Add the route."""

    @app.post("/api/lease")
    async def lease(request: Request) -> Response:
        office = console.office
        if office is None:
            return refused(409, "this is a recording: there is no control to take")
        try:
            body = await body_of(request)
            token = token_of(request, body)
            action = (text_of(body, "action") or "take").replace("-", "_").replace(" ", "_")
            if action == "take":
                name = (text_of(body, "name") or office.holder_of(token) or SOMEBODY).strip()
                for_s = body.get("for_s", LEASE_S)
                if isinstance(for_s, bool) or not isinstance(for_s, int | float) or abs(for_s) > MOST_S:
                    raise ValueError(f"for_s is {for_s!r:.40}, expected seconds")
                fresh = await office.take(name, token, float(for_s), text_of(body, "force"))
                return JSONResponse({"accepted": True, "token": fresh, "holder": name})
            if action in ("give_up", "give", "release"):
                await office.give(token)
                return JSONResponse({"accepted": True, "holder": ""})
            if action in ("pass_on", "pass"):
                to = (text_of(body, "to") or text_of(body, "name")).strip()
                if not to:
                    raise ValueError("passing control on needs 'to', a name")
                await office.give(token, to)
                return JSONResponse({"accepted": True, "holder": to})
            raise ValueError(f"action is {action!r:.40}, expected take, give_up or pass_on")
        except (ValueError, ArgumentError) as error:
            return refused(400, str(error))
        except NotAllowedError as error:
            return refused(409, str(error))
