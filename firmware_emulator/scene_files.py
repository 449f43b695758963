"""Files of cameras and scenes as the emulator reads them: numbers by keys, a table for each mock-up."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

from drivers.files.errors import FileError
from drivers.files.reading import read_bytes
from drivers.files.trees import parse_json, parse_toml

Made = TypeVar("Made")


class SceneError(FileError):
    """A file cannot be used; the message names file, place and what was expected."""


class CameraFile:
    """The keys of a camera file (JSON).

    Args:
        path: Of the file.

    Raises:
        FileError: The file is missing or is no JSON object.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._data = path, parse_json(read_bytes(path), path)

    def numbers(self, key: str, count: int) -> tuple[float, ...]:
        """A list of numbers.

        Raises:
            SceneError: The key is missing or holds something else.
        """
        found = self._data.get(key)
        values = found if isinstance(found, list) else [found]
        if len(values) != count or not all(map(is_number, values)):
            wanted = "a finite number" if count == 1 else f"a list of {count} finite numbers"
            raise SceneError(f"{self._path}: key {key!r} must be {wanted}, found {found!r:.80}")
        return tuple(map(float, values))

    def number(self, key: str) -> float:
        """One number.

        Raises:
            SceneError: As for `numbers`.
        """
        return self.numbers(key, 1)[0]

    def makes(self, make: Callable[["CameraFile"], Made]) -> Made:
        """What is made of its keys.

        Raises:
            SceneError: A key is missing, or what its numbers describe is impossible.
        """
        try:
            return make(self)
        except SceneError:
            raise
        except ValueError as error:
            raise SceneError(f"{self._path}: {error}") from error


def read_tables(path: Path, make: Callable[[Mapping[str, Any]], Made], expected: str) -> dict[str, Made]:
    """One table for each mock-up (TOML), and what is made of it.

    Args:
        path: Of the file.
        make: Of one table.
        expected: Keys of a table, for sentences.

    Raises:
        FileError: The file is missing or is not of that form.
    """
    data = parse_toml(read_bytes(path), path)
    try:
        return {name: make(table) for name, table in data.items()}
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise SceneError(f"{path}: expected tables with {expected}: {error!r:.200}") from error


def is_number(value: object) -> TypeGuard[float]:
    """Whether it is a finite number, not a whole one of hundreds of digits."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False
