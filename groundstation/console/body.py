"""What is posted, a JSON object of a bounded length, and how it is refused."""

import json
from collections.abc import Mapping

from fastapi import Request
from fastapi.responses import JSONResponse, Response

HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:; "
    "style-src 'self' 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}
TOKEN_HEADER = "x-lease-token"
LONGEST_BODY = 100_000


async def body_of(request: Request) -> dict[str, object]:
    """The JSON object of a request; an empty body is an empty one.

    Raises:
        ValueError: It is none, or too long; the sentence says so.
    """
    text = b""
    async for chunk in request.stream():  # its length need not be told beforehand
        text += chunk
        if len(text) > LONGEST_BODY:
            raise ValueError(f"a request has at most {LONGEST_BODY} bytes")
    try:
        given = json.loads(text or b"{}")
    except (ValueError, RecursionError):
        raise ValueError("expected a JSON object") from None
    if not isinstance(given, dict):
        raise ValueError(f"expected a JSON object, found {type(given).__name__}")
    return given


def text_of(body: Mapping[str, object], key: str) -> str:
    """A text of a body; empty where it is left out.

    Raises:
        ValueError: It is something else.
    """
    given = body.get(key)
    if given is None:
        return ""
    if not isinstance(given, str):
        raise ValueError(f"{key} is {given!r:.40}, expected text")
    return given


def arguments_of(body: Mapping[str, object]) -> dict[str, object]:
    """The arguments of a request; none where they are left out.

    Raises:
        ValueError: They are no JSON object.
    """
    given = body.get("arguments")
    if given is None:
        return {}
    if not isinstance(given, dict):
        raise ValueError(f"arguments is {given!r:.40}, expected a JSON object")
    return given


def token_of(request: Request, body: Mapping[str, object]) -> str:
    """The lease's token: in the body, or in a header.

    Raises:
        ValueError: It is no text.
    """
    bearer = request.headers.get("authorization", "").removeprefix("Bearer ").strip()
    return text_of(body, "token") or request.headers.get(TOKEN_HEADER, "") or bearer


def refused(status: int, reason: str) -> Response:
    """An answer with a reason."""
    return JSONResponse({"accepted": False, "reason": reason}, status, headers=HEADERS)
