"""Frames of the console's WebSocket: one byte says what it is.

``J`` JSON text; ``P`` a picture: length of a JSON head (u32), the head, JPEG bytes; ``C`` samples of charts:
length of a JSON head (u32), the head, then for each of its ``fields`` times and values as float64. All little
endian; the head is filled up with blanks so that numbers begin at a multiple of eight.
"""

import json
import math
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from groundstation.console.chart_tap import Samples

JSON, PICTURE, CHART = b"J", b"P", b"C"
_LENGTH = struct.Struct("<I")
_BEFORE_HEAD = 5


def plain(value: Any) -> Any:  # noqa: ANN401 whatever JSON can hold, and numbers that it cannot
    """The same with null in the place of infinity and NaN, which JSON has not."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    return value


def json_frame(content: Mapping[str, Any]) -> bytes:
    """A frame of JSON."""
    return JSON + json.dumps(plain(content), separators=(",", ":"), allow_nan=False).encode()


def picture_frame(head: Mapping[str, Any], jpeg: bytes) -> bytes:
    """A picture with what is known of it."""
    return _headed(PICTURE, head) + jpeg


def chart_frame(samples: Mapping[str, Samples], *, is_whole: bool = False) -> bytes:
    """Samples of fields; all that there are of them, or those since the last."""
    fields = [
        {"name": name, "count": len(times_s), "whole": is_whole} for name, (times_s, _) in samples.items()
    ]
    numbers = [np.ascontiguousarray(part, "<f8").tobytes() for pair in samples.values() for part in pair]
    return _headed(CHART, {"fields": fields}) + b"".join(numbers)


def _headed(kind: bytes, head: Mapping[str, Any]) -> bytes:
    text = json.dumps(plain(head), separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-(len(text) + _BEFORE_HEAD) % 8)
    return kind + _LENGTH.pack(len(text)) + text
