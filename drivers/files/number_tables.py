"""Tables of numbers and words: the one reader of CSV files and their like.

A header names the columns, whatever their order. Byte order marks, UTF-16, the Windows code page, quotes, any
ends of lines, semicolons or tabs between cells and, with these, decimal commas are understood; so are Excel's
``sep=;`` and the empty cells that it appends. What is wrong is named by line and column.
"""

from __future__ import annotations

import csv
import io
import math
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.files.errors import FileError
from drivers.files.reading import read_bytes, text_of

Array = NDArray[np.float64]
_DELIMITERS = ",;\t"
_SEPARATOR = re.compile(r"\s*\"?sep=(.)\"?\s*")
_BINARY = re.compile(rb"[\x00-\x08\x0b\x0e-\x19\x1b-\x1f\x7f]")
_OTHER_UNITS = {"_m": ("_mm", "_cm"), "_s": ("_ms", "_us"), "_rad": ("_deg",), "_deg": ("_rad",)}
_MOST_SHOWN = 60


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns that were asked for.

    Attributes:
        numbers: The columns of numbers in the order in which they were asked for, shape (n, k).
        words: The columns of words by name, n each.
        lines: Of the file, for each row, shape (n,).
    """

    numbers: Array
    words: dict[str, list[str]]
    lines: NDArray[np.int64]


def load_table(
    path: Path,
    numbers: Sequence[str],
    words: Sequence[str] = (),
    *,
    optional: Sequence[str] = (),
    unique: Sequence[str] = (),
    is_finite: bool = True,
    most: Mapping[str, float] | None = None,
) -> Table:
    """Read a file; see ``parse_table``.

    Raises:
        FileError: The file is missing, or a column or a value of it is.
    """
    return parse_table(
        read_bytes(path),
        path,
        numbers,
        words,
        optional=optional,
        unique=unique,
        is_finite=is_finite,
        most=most,
    )


def parse_table(
    data: bytes,
    path: Path,
    numbers: Sequence[str],
    words: Sequence[str] = (),
    *,
    optional: Sequence[str] = (),
    unique: Sequence[str] = (),
    is_finite: bool = True,
    most: Mapping[str, float] | None = None,
) -> Table:
    """Read named columns of a table.

    Args:
        data: Content of the file.
        path: Its name, for messages.
        numbers: Columns of numbers.
        words: Columns of text; cells are stripped.
        optional: Columns that may be missing; numbers are then NaN, words empty.
        unique: Those of ``words`` in which no cell may appear twice.
        is_finite: Whether NaN and infinity are refused.
        most: Largest amounts of columns of numbers; beyond them the file is in other units.

    Raises:
        FileError: No text, no header, no row, a missing or doubled column, a short or long row, a cell that
            is no number or too large, or one that appears twice.
    """
    text, doubt = _decoded(data, path)
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise FileError(f"{path}: line {line} holds a zero byte: damaged, or no text; save it as CSV UTF-8.")
    try:
        table = _parsed(text, path, numbers, words, optional, unique, is_finite=is_finite)
    except FileError:
        if doubt is not None:
            raise doubt from None
        raise
    for name, amount in (most or {}).items():
        _check_amounts(table, path, numbers.index(name), name, amount)
    return table


def csv_text(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return the text of a table, commas between cells."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return out.getvalue()


def _decoded(data: bytes, path: Path) -> tuple[str, FileError | None]:
    """Return the text; what is no UTF-8 may be of Excel under Windows: then also how it is refused if not."""
    try:
        return text_of(data, path), None
    except FileError as error:
        if _BINARY.search(data):
            raise
        try:
            return data.decode("cp1252").replace("\r\n", "\n").replace("\r", "\n"), error
        except UnicodeDecodeError:
            raise error from None


def _parsed(
    text: str,
    path: Path,
    numbers: Sequence[str],
    words: Sequence[str],
    optional: Sequence[str],
    unique: Sequence[str],
    *,
    is_finite: bool,
) -> Table:
    header_line, header, delimiter = _header(text, path, (*words, *numbers))
    _check(header, path, header_line, [name for name in (*words, *numbers) if name not in optional])
    wanted = [header.index(name) if name in header else -1 for name in numbers]
    if not words:
        found = _fast(text, header_line, len(header), delimiter, wanted, is_finite=is_finite)
        if found is not None:
            return Table(found, {}, header_line + 1 + np.arange(len(found)))
    read = _NumberReader(path, delimiter, is_finite)
    rows: list[list[float]] = []
    text_of_column: dict[str, list[str]] = {name: [] for name in words}
    first_line: dict[tuple[str, str], int] = {}
    lines: list[int] = []
    for line, cells in _rows(text, path, header_line, delimiter, len(header)):
        if len(cells) != len(header):
            hint = ""
            if delimiter == "," and len(cells) > len(header):
                hint = " (decimal commas need semicolons between the cells)"
            raise FileError(f"{path}: line {line} has {len(cells)} columns, expected {len(header)}{hint}.")
        for name in words:
            cell = cells[header.index(name)].strip() if name in header else ""
            first = first_line.setdefault((name, cell), line)
            if name in unique and first != line:
                raise FileError(
                    f"{path}: line {line}, {name} '{_shown(cell)}' appears twice, first in line {first}."
                )
            text_of_column[name].append(cell)
        rows.append(
            [
                math.nan if place < 0 else read(cells[place], line, name)
                for name, place in zip(numbers, wanted, strict=True)
            ]
        )
        lines.append(line)
    if not rows:
        raise FileError(f"{path}: has a header but no rows.")
    return Table(np.array(rows, dtype=np.float64).reshape(len(rows), -1), text_of_column, np.array(lines))


def _header(text: str, path: Path, known: Sequence[str]) -> tuple[int, list[str], str]:
    """Return line and cells of the header, and what stands between cells."""
    delimiters = _DELIMITERS
    for number, line in enumerate(text.split("\n"), start=1):
        stated = _SEPARATOR.fullmatch(line)
        if stated is not None and delimiters == _DELIMITERS:
            delimiters = stated[1]
            continue
        if not line.strip():
            continue
        try:
            split = {mark: _names(line, mark) for mark in delimiters}
        except csv.Error as error:
            raise FileError(f"{path}: line {number} is no header of a table ({error}).") from error
        # most of the known names; if none is there, most cells
        best = max(split, key=lambda mark: (len(set(split[mark]) & set(known)), len(split[mark])))
        return number, split[best], best
    raise FileError(f"{path}: is empty, expected the header {','.join(known)}.")


def _names(line: str, delimiter: str) -> list[str]:
    names = [name.strip() for name in next(csv.reader([line], delimiter=delimiter))]
    while names and not names[-1]:  # of columns that a spreadsheet has emptied
        names.pop()
    return names


def _check(header: list[str], path: Path, line: int, needed: Sequence[str]) -> None:
    for name in needed:
        if name in header:
            continue
        end = next((end for end in _OTHER_UNITS if name.endswith(end)), "")
        others = (name.removesuffix(end) + unit for unit in _OTHER_UNITS.get(end, ()))
        other = next((other for other in others if other in header), "")
        hint = f"; convert '{other}'" if other else ""
        if len(header) == 1 and set(needed) & set(header[0].split()):
            hint = "; put commas or semicolons between the cells"
        found = _shown(", ".join(header), 300)
        raise FileError(f"{path}: line {line}, column '{name}' is missing; found {found}{hint}.")
    for name in header:
        if name and header.count(name) > 1:
            raise FileError(f"{path}: line {line}, column '{_shown(name)}' appears twice.")


def _fast(
    text: str, header_line: int, cells: int, delimiter: str, wanted: Sequence[int], *, is_finite: bool
) -> Array | None:
    """Read a plain table of numbers with NumPy; None where something is not plain."""
    body = text.split("\n", header_line)[-1].strip("\n")
    rows = body.count("\n") + 1
    is_plain = '"' not in body and body.count(delimiter) == rows * (cells - 1)
    if not body or not is_plain or min(wanted) < 0 or (delimiter != "," and "," in body):
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            table = np.loadtxt(io.StringIO(body), delimiter=delimiter, usecols=wanted, ndmin=2, comments=None)
    except ValueError:
        return None
    if len(table) != rows or (is_finite and not np.isfinite(table).all()):
        return None
    return np.asarray(table, dtype=np.float64)


def _rows(
    text: str, path: Path, header_line: int, delimiter: str, width: int
) -> Iterator[tuple[int, list[str]]]:
    """Yield line and cells of every row that is not blank, without blank cells behind the last column."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        for cells in reader:
            if reader.line_num > header_line and any(cell.strip() for cell in cells):
                while len(cells) > width and not cells[-1].strip():
                    cells.pop()
                yield reader.line_num, cells
    except csv.Error as error:
        raise FileError(f"{path}: line {reader.line_num} is no row of a table ({error}).") from error


class _NumberReader:
    """Reads the cells of one file: either all of its numbers have decimal commas, or none has."""

    def __init__(self, path: Path, delimiter: str, is_finite: bool) -> None:
        self._path, self._may_be_comma, self._is_finite = path, delimiter != ",", is_finite
        self._first: dict[str, int] = {}  # line of the first decimal comma, and of the first point

    def __call__(self, cell: str, line: int, name: str) -> float:
        text = cell.strip()
        mark = next((mark for mark in ".," if mark in text), "")
        hint = ""
        if mark == "," and self._may_be_comma:
            text = text.replace(",", ".", 1)
        elif mark == ",":
            hint = " (decimal commas need semicolons between the cells)"
        value: float | None
        try:
            value = None if "_" in text else float(text)
        except ValueError:
            value = None
        if value is None or (self._is_finite and not math.isfinite(value)):
            raise FileError(
                f"{self._path}: line {line}, {name} is '{_shown(cell.strip())}', expected a number{hint}."
            )
        if mark and self._may_be_comma:
            self._first.setdefault(mark, line)
            if len(self._first) > 1:
                other = "," if mark == "." else "."
                words = {".": "a decimal point", ",": "a decimal comma"}
                raise FileError(
                    f"{self._path}: line {line}, {name} is '{cell.strip()}' with {words[mark]}, "
                    f"but line {self._first[other]} has {words[other]}; use one of them."
                )
        return value


def _check_amounts(table: Table, path: Path, column: int, name: str, most: float) -> None:
    values = table.numbers[:, column]
    beyond = np.flatnonzero(np.abs(values) > most)
    if len(beyond):
        end = next((end for end in _OTHER_UNITS if name.endswith(end)), "")
        unit = end.removeprefix("_")
        others = " or ".join(other.removeprefix("_") for other in _OTHER_UNITS.get(end, ()))
        hint = f" (is it in {others}?)" if others else ""
        line, value = table.lines[beyond[0]], values[beyond[0]]
        asked = f"{most:g} {unit}".rstrip()
        raise FileError(f"{path}: line {line}, {name} is {value:g}, expected at most {asked}{hint}.")


def _shown(text: str, most: int = _MOST_SHOWN) -> str:
    return text if len(text) <= most else f"{text[: most - 3]}..."
