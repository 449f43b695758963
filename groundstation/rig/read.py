"""Reads a rig file: one sentence for each mistake, and every file that it names once.

Paths inside are relative to the rig file's folder. Children of a run are handed the bytes that the
launcher has read, so that what flies is what was hashed.
"""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from groundstation.declarations.calls import calling, in_one_line
from groundstation.declarations.errors import RigError
from groundstation.declarations.rig import MOCK_UP_RADIUS_M, Rig
from groundstation.declarations.rig_file import RigFile
from groundstation.declarations.tables import Tables
from groundstation.declarations.validation import first_sentence
from groundstation.files.errors import FileError
from groundstation.files.reading import open_file, path_of, read_bytes, text_of
from groundstation.files.toml_file import toml_of
from groundstation.parts.table import installed_tables
from groundstation.rig.compose import rig_model
from groundstation.rig.plan import check_plan

RigFiles = Mapping[str, bytes]
"""Bytes of the files that a rig names, by absolute path."""


def load_rig(path: Path, tables: Tables | None = None) -> Rig:
    """Read a rig file.

    Args:
        path: Of the file.
        tables: Of the parts that its keys belong to; those installed by default.

    Raises:
        RigError: One sentence with file and key or line.
    """
    return parse_rig(read_text(path), path, tables=tables)


def read_text(path: Path, what: str = "rig file") -> str:
    """The text of a rig file.

    Args:
        path: Of the file.
        what: As sentences call it.

    Raises:
        RigError: There is no such file, or it is no text.
    """
    try:
        with open_file(path) as file:
            content = file.read()
    except FileNotFoundError as error:
        raise RigError(f"{path}: there is no such {what}") from error
    except OSError as error:
        raise RigError(f"{path}: cannot be read as a {what} ({error.strerror})") from error
    except ValueError as error:  # a NUL in the name
        raise RigError(f"{str(path)!r}: cannot be read as a {what} ({error})") from error
    try:
        return text_of(content, path)
    except FileError as error:
        raise RigError(str(error)) from error


def parse_rig(text: str, path: Path, files: RigFiles | None = None, tables: Tables | None = None) -> Rig:
    """Read the text of a rig file.

    Args:
        text: Of the file.
        path: Where it stands: relative paths inside start at its folder.
        files: What the files that it names hold; None reads them from disk.
        tables: Of the parts that its keys belong to; those installed by default.

    Raises:
        RigError: One sentence with file and key or line.
    """
    try:
        content = toml_of(text, path)
    except FileError as error:
        raise RigError(in_one_line(str(error))) from error
    if "rig" in content:
        raise RigError(f"{path}: is a scenario; expected a rig, such as its key 'rig' names")
    return build_rig(content, path, files, tables)


def build_rig(
    content: dict[str, Any],
    path: Path,
    files: RigFiles | None = None,
    tables: Tables | None = None,
    known: RigFiles | None = None,
) -> Rig:
    """Make a rig of the keys of its file.

    Args:
        content: The keys.
        path: Of the file.
        files: What the files that it names hold, all of them; None reads them from disk.
        tables: Of the parts that its keys belong to; those installed by default.
        known: What some of them hold: these are not read again.

    Raises:
        RigError: One sentence with file and key.
    """
    model = rig_model(tables or installed_tables())
    if isinstance(content.get("laboratory"), dict):
        folder = {"folder": str(path.parent.resolve())}
        content = {**content, "laboratory": {**content["laboratory"], **folder}}
    try:
        rig = model.model_validate(content, context={"read_file": _Reader(path.parent, files, known or {})})
        _check_vehicles(rig)
        for part in model.tables.parts.values():
            with calling(part.title, "check"):
                part.check(rig)
        check_plan(rig)
    except FileError as error:
        raise RigError(in_one_line(str(error))) from error
    except ValidationError as error:
        raise RigError(f"{path}: {first_sentence(error)}") from error
    except (RigError, ValueError) as error:
        raise RigError(f"{path}: {in_one_line(str(error))}") from error
    rig.keep_source(Source(content, path))
    return rig


def files_of(rig: Rig) -> dict[str, RigFile]:
    """Every file that a rig names, by its keys: ``mock_ups.standard.star_camera.camera``."""
    return dict(_files("", rig))


def _files(where: str, value: object) -> Iterator[tuple[str, RigFile]]:
    if isinstance(value, RigFile):
        yield where, value
    elif isinstance(value, BaseModel):
        for name in type(value).model_fields:
            yield from _files(f"{where}.{name}" if where else name, getattr(value, name))
    elif isinstance(value, Mapping):
        for name, item in value.items():
            yield from _files(f"{where}.{name}", item)
    elif isinstance(value, tuple | list):
        for number, item in enumerate(value):
            yield from _files(f"{where}.{number}", item)


@dataclass(frozen=True)
class Source:
    """What a rig was made from.

    Attributes:
        content: Keys of the file.
        path: Of the file.
    """

    content: dict[str, Any]
    path: Path


def source_of(rig: Rig) -> Source:
    """What a rig was made from."""
    found = rig.source
    assert isinstance(found, Source)
    return found


class _Reader:
    """Reads each file once, however many keys name it."""

    def __init__(self, folder: Path, files: RigFiles | None, known: RigFiles) -> None:
        self._folder = folder
        self._given = files
        self._known = known
        self._read: dict[Path, RigFile] = {}

    def __call__(self, name: str) -> RigFile:
        path = self._folder / path_of(name)
        found = self._read.get(path)
        if found is None:
            found = self._read[path] = RigFile(path, self._bytes(path))
        return found

    def _bytes(self, path: Path) -> bytes:
        name = os.path.abspath(path)  # noqa: PTH100 - resolve() would follow links
        if self._given is not None:
            if name not in self._given:
                raise FileError(f"{path}: was not among the files of the run.")
            return self._given[name]
        if name in self._known:
            return self._known[name]
        return read_bytes(path)


def bytes_of(rig: Rig) -> dict[str, bytes]:
    """What a child is handed: the bytes of every file of a rig, by absolute path."""
    return {os.path.abspath(file.path): file.data for file in files_of(rig).values()}  # noqa: PTH100


def _check_vehicles(rig: Rig) -> None:
    for name, vehicle in rig.vehicles.items():
        if vehicle.mock_up not in rig.mock_ups:
            known = ", ".join(sorted(rig.mock_ups)) or "none"
            raise ValueError(f"vehicles.{name}.mock_up: {vehicle.mock_up!r} is not among mock_ups ({known})")
        hold = vehicle.hold
        if not rig.table.holds(hold.x_m, hold.y_m):
            raise ValueError(
                f"vehicles.{name}.hold: ({hold.x_m:g}, {hold.y_m:g}) m is nearer than "
                f"{MOCK_UP_RADIUS_M:g} m to the table's edge, or beyond it"
            )
