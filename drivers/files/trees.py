"""JSON and TOML: parsed, or refused in one sentence, whatever they hold."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from drivers.files.errors import FileError
from drivers.files.reading import text_of

DEEPEST = 64
"""Tables in tables, lists in lists: nobody means more, and recursion ends somewhere."""
_LONG_KEY = re.compile(rf"""(?:[\w"'-]{{1,64}}\s{{0,9}}\.\s{{0,9}}){{{DEEPEST}}}""")


def parse_json(data: bytes, path: Path) -> dict[str, Any]:
    """Read a file that holds one JSON object.

    Raises:
        FileError: It is no text, no JSON or no object, states a key twice, or is nested too deep.
    """
    try:
        found = json.loads(text_of(data, path), object_pairs_hook=_once)
    except json.JSONDecodeError as error:
        raise FileError(
            f"{path}: line {error.lineno}, column {error.colno} is no JSON ({error.msg})."
        ) from error
    except RecursionError as error:
        raise FileError(f"{path}: is nested deeper than {DEEPEST} levels.") from error
    except FileError:
        raise
    except ValueError as error:  # a key twice, or a number of thousands of digits
        raise FileError(f"{path}: {_short(error)}.") from error
    if not isinstance(found, dict):
        raise FileError(f"{path}: expected a JSON object, found {type(found).__name__}.")
    _check_depth(found, path)
    return found


def parse_toml(data: bytes, path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises:
        FileError: It is no text or no TOML, or is nested too deep.
    """
    return toml_of(text_of(data, path), path)


def toml_of(text: str, path: Path) -> dict[str, Any]:
    """Read the text of a TOML file.

    Raises:
        FileError: It is no TOML, or is nested too deep.
    """
    long_key = _LONG_KEY.search(text)
    if long_key is not None:  # the parser would take hours for one of a hundred thousand parts
        line = text.count("\n", 0, long_key.start()) + 1
        raise FileError(f"{path}: line {line} is nested deeper than {DEEPEST} levels.")
    try:
        found = tomllib.loads(text)
    except RecursionError as error:
        raise FileError(f"{path}: is nested deeper than {DEEPEST} levels.") from error
    except ValueError as error:  # TOMLDecodeError, or a number of thousands of digits
        raise FileError(f"{path}: is not valid TOML: {_short(error)}.") from error
    _check_depth(found, path)
    return found


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"key '{twice[:60]}' appears twice")
    return found


def _check_depth(tree: object, path: Path) -> None:
    level = [tree]
    for _ in range(DEEPEST):
        level = [
            item
            for node in level
            if isinstance(node, dict | list)
            for item in (node.values() if isinstance(node, dict) else node)
        ]
        if not level:
            return
    raise FileError(f"{path}: is nested deeper than {DEEPEST} levels.")


def _short(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text if len(text) <= 200 else f"{text[:197]}..."
