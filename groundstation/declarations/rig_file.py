"""A file that a rig names: read once, so that what flew is what was hashed.

In sections ``RigFile`` is the type of a key that holds a path. The bytes come from the reader that whoever
parses the rig puts into the validation context; the value is parsed once per file.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from groundstation.files.reading import text_of

T = TypeVar("T")


class RigFile:
    """One file.

    Attributes:
        path: Where it stands.
        data: Its bytes.
        sha256: Of the bytes.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        self.path = path
        self.data = data
        self.sha256 = hashlib.sha256(data).hexdigest()
        self._values: dict[object, Any] = {}

    def value(self, parse: Callable[[bytes, Path], T]) -> T:
        """What the file states, parsed at the first call from the bytes that were hashed."""
        if parse not in self._values:
            self._values[parse] = parse(self.data, self.path)
        found: T = self._values[parse]
        return found

    def text(self) -> str:
        """The file as text.

        Raises:
            FileError: It is no text.
        """
        return text_of(self.data, self.path)

    def __repr__(self) -> str:
        return f"RigFile({str(self.path)!r}, sha256 {self.sha256[:8]})"

    @classmethod
    def __get_pydantic_core_schema__(cls, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        del source, handler
        return core_schema.with_info_plain_validator_function(
            _read, serialization=core_schema.plain_serializer_function_ser_schema(_plain)
        )


ReadFile = Callable[[str], RigFile]
"""Gives the file of a path as the rig file spells it."""


def _read(given: object, info: ValidationInfo) -> RigFile:
    if isinstance(given, RigFile):
        return given
    if not isinstance(given, str | Path):
        raise ValueError("expected the path of a file")
    read: ReadFile = (info.context or {})["read_file"]
    return read(str(given))


def _plain(file: RigFile) -> dict[str, str]:
    return {"path": str(file.path), "sha256": file.sha256}
