"""Tables of numbers and words: the one reader of CSV files and their like.

A header names the columns, whatever their order. Byte order mark, quotes, CRLF, semicolons or tabs
between cells and, with these, decimal commas are understood. What is wrong is named by line and column.
"""

from __future__ import annotations

import csv
import io
import math
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes, text_of

Array = NDArray[np.float64]
_DELIMITERS = ",;\t"


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
) -> Table:
    """Read a file; see ``parse_table``.

    Raises:
        FileError: The file is missing, or a column or a value of it is.
    """
    return parse_table(
        read_bytes(path), path, numbers, words, optional=optional, unique=unique, is_finite=is_finite
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

    Raises:
        FileError: No text, no header, no row, a missing or doubled column, a short or long row, a cell that
            is no number, or one that appears twice.
    """
    text = text_of(data, path)
    header_line, header, delimiter = _header(text, path, (*words, *numbers))
    _check(header, path, header_line, [name for name in (*words, *numbers) if name not in optional])
    wanted = [header.index(name) if name in header else -1 for name in numbers]
    if not words:
        found = _fast(text, header_line, len(header), delimiter, wanted, is_finite=is_finite)
        if found is not None:
            return Table(found, {}, header_line + 1 + np.arange(len(found)))
    rows: list[list[float]] = []
    text_of_column: dict[str, list[str]] = {name: [] for name in words}
    first_line: dict[tuple[str, str], int] = {}
    lines: list[int] = []
    for line, cells in _rows(text, path, header_line, delimiter):
        if len(cells) != len(header):
            raise FileError(f"{path}: line {line} has {len(cells)} columns, expected {len(header)}.")
        for name in words:
            cell = cells[header.index(name)].strip() if name in header else ""
            first = first_line.setdefault((name, cell), line)
            if name in unique and first != line:
                raise FileError(f"{path}: line {line}, {name} '{cell}' appears twice, first in line {first}.")
            text_of_column[name].append(cell)
        rows.append(
            [
                math.nan if place < 0 else _number(cells[place], delimiter, path, line, name, is_finite)
                for name, place in zip(numbers, wanted, strict=True)
            ]
        )
        lines.append(line)
    if not rows:
        raise FileError(f"{path}: has a header but no rows.")
    return Table(np.array(rows, dtype=np.float64).reshape(len(rows), -1), text_of_column, np.array(lines))


def csv_text(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return the text of a table, commas between cells."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return out.getvalue()


def _header(text: str, path: Path, known: Sequence[str]) -> tuple[int, list[str], str]:
    """Return line and cells of the header, and what stands between cells."""
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        split = {
            mark: [name.strip() for name in next(csv.reader([line], delimiter=mark))] for mark in _DELIMITERS
        }
        # most of the known names; if none is there, most cells
        best = max(split, key=lambda mark: (len(set(split[mark]) & set(known)), len(split[mark])))
        return number, split[best], best
    raise FileError(f"{path}: is empty, expected the header {','.join(known)}.")


def _check(header: list[str], path: Path, line: int, needed: Sequence[str]) -> None:
    for name in needed:
        if name not in header:
            raise FileError(f"{path}: line {line}, column '{name}' is missing; found {', '.join(header)}.")
    for name in header:
        if name and header.count(name) > 1:
            raise FileError(f"{path}: line {line}, column '{name}' appears twice.")


def _fast(
    text: str, header_line: int, cells: int, delimiter: str, wanted: Sequence[int], *, is_finite: bool
) -> Array | None:
    """Read a plain table of numbers with NumPy; None where something is not plain."""
    body = text.split("\n", header_line)[-1].strip("\r\n")
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


def _rows(text: str, path: Path, header_line: int, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield line and cells of every row that is not blank."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        for cells in reader:
            if reader.line_num > header_line and any(cell.strip() for cell in cells):
                yield reader.line_num, cells
    except csv.Error as error:
        raise FileError(f"{path}: line {reader.line_num} is no row of a table ({error}).") from error


def _number(cell: str, delimiter: str, path: Path, line: int, name: str, is_finite: bool) -> float:
    text = cell.strip()
    if delimiter != "," and "." not in text:
        text = text.replace(",", ".", 1)
    value: float | None
    try:
        value = None if "_" in text else float(text)
    except ValueError:
        value = None
    if value is None or (is_finite and not math.isfinite(value)):
        raise FileError(f"{path}: line {line}, {name} is '{cell.strip()}', expected a number.")
    return value
