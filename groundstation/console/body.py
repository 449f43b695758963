"""What is posted: a JSON object of a bounded length."""

import json

from fastapi import Request

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
