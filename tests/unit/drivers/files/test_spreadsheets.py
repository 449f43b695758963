"""Tables as spreadsheets and people leave them: read as they are meant, or refused by line and column."""

import bz2
import gzip
import lzma
from pathlib import Path

import pytest

from drivers.files.errors import FileError
from drivers.files.number_tables import load_table, parse_table

PATH = Path("table.csv")
ROWS = [("Süd", "1.5", "2"), ("b", "-0.25", "3e-1")]


def table(cell=",", end="\r\n", *, comma=False, quote=False, tail="", head=""):
    rows = [("id", "x_m", "y_m"), *ROWS]
    if comma:
        rows = [rows[0], *((name, *(v.replace(".", ",") for v in values)) for name, *values in ROWS)]
    lines = [cell.join(f'"{v}"' if quote else v for v in row) + tail for row in rows]
    return head + end.join(lines) + end


GOOD = {
    "CSV UTF-8": "\ufeff" + table(),
    "CSV, Windows": table(";", comma=True).encode("cp1252"),
    "CSV, old Macintosh": table(";", "\r"),
    "Unicode text": table("\t", comma=True).encode("utf-16"),
    "Unicode text, big-endian": b"\xfe\xff" + table("\t").encode("utf-16-be"),
    "sep=": table(";", head="sep=;\r\n"),
    "sep=|": table("|", head="sep=|\r\n"),
    "columns that were emptied": table(tail=",,"),
    "rows that were emptied": table() + ",,\r\n,,\r\n",
    "trailing cells dropped": table().replace("y_m\r\n", "y_m,,\r\n"),
    "a last line of spaces": table() + "   ",
    "a last line of spaces and an end": table() + " \t \r\n\r\n",
    "quotes": table(quote=True),
    "quotes and decimal commas": table(";", comma=True, quote=True),
    "spaces around": table(" , "),
}


@pytest.mark.parametrize("what", GOOD)
def test_what_a_spreadsheet_exports_is_read(what):
    text = GOOD[what]
    data = text if isinstance(text, bytes) else text.encode()
    found = parse_table(data, PATH, ("x_m", "y_m"), ("id",), unique=("id",))
    assert found.numbers.tolist() == [[1.5, 2.0], [-0.25, 0.3]]
    assert found.words["id"] == ["Süd", "b"]
    assert parse_table(data, PATH, ("x_m", "y_m")).numbers.tolist() == found.numbers.tolist()


NO_TEXT = {
    "a packed table": (gzip.compress(b"id,x_m,y_m\n0,1,2\n"), "is compressed (.gz) and no text; unpack it"),
    "a table packed by bzip2": (bz2.compress(b"id,x_m\n"), "is compressed (.bz2) and no text; unpack it"),
    "a table packed by xz": (lzma.compress(b"id,x_m\n"), "is compressed (.xz) and no text; unpack it"),
    "an empty archive": (b"PK\x05\x06" + bytes(18), "is an empty archive (.zip) and no text"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(40), "is a picture (.png) and no text; save what it holds"),
    "a document": (b"%PDF-1.4\n", "is a document (.pdf) and no text; save what it holds as text"),
    "a recording": (b"\x89MCAP0\r\n" + bytes(40), "is a recording (.mcap) and no text"),
    "bytes of any kind": (bytes(range(250, 0, -1)), "line 1 is no UTF-8); save it as UTF-8"),
    "half a character": ("id,x_m\n".encode("utf-16")[:-1], "is no UTF-16); save it as UTF-8"),
    "a zero byte in a number": (b"id,x_m,y_m\n0,1\x005,2\n", "line 2 holds a zero byte: damaged, or no text"),
    "a zero byte in a word": (b"id,x_m,y_m\na\x00b,1,2\n", "line 2 holds a zero byte"),
    "a zero byte in the header": (b"i\x00d,x_m,y_m\n0,1,2\n", "line 1 holds a zero byte"),
    "an end that was not written": (
        b"id,x_m,y_m\n0,1,2\n" + bytes(512),
        "line 3 holds a zero byte: damaged, or no text; save it as CSV UTF-8",
    ),
}


@pytest.mark.parametrize("words", [(), ("id",)])
@pytest.mark.parametrize("what", NO_TEXT)
def test_what_is_no_text_is_refused_with_what_to_do(what, words):
    data, sentence = NO_TEXT[what]
    with pytest.raises(FileError) as refused:
        parse_table(data, PATH, ("x_m", "y_m"), words)
    assert sentence in str(refused.value)


def test_a_folder_is_no_table(tmp_path):
    with pytest.raises(FileError, match="is a folder, expected a file"):
        load_table(tmp_path, ("x_m",))


BAD = {
    "a workbook": (b"PK\x03\x04" + bytes(40), "is a workbook (.xlsx, .ods) and no text; save it as CSV"),
    "an old workbook": (b"\xd0\xcf\x11\xe0" + bytes(40), "is a workbook (.xls) and no text"),
    "decimal commas between commas": (
        "id,x_m,y_m\n0,1,5,2,25\n",
        "line 2 has 5 columns, expected 3 (decimal commas need semicolons between the cells)",
    ),
    "quoted decimal commas between commas": (
        'id,x_m,y_m\n0,"1,5",2\n',
        "line 2, x_m is '1,5', expected a number (decimal commas need semicolons between the cells)",
    ),
    "points of thousands": (
        "id;x_m;y_m\n0;0,5;2\n1;1.234;2\n",
        "line 3, x_m is '1.234' with a decimal point, but line 2 has a decimal comma",
    ),
    "spaces between cells": (
        "id  x_m  y_m\n0   1.5  2\n",
        "line 1, column 'id' is missing; found id  x_m  y_m; put commas or semicolons between the cells",
    ),
    "millimetres by their name": (
        "id,x_mm,y_mm\n0,1500,2000\n",
        "line 1, column 'x_m' is missing; found id, x_mm, y_mm; convert 'x_mm'",
    ),
    "millimetres by their size": (
        "id,x_m,y_m\n0,0.5,2\n1,1500,2\n",
        "line 3, x_m is 1500, expected at most 100 m (is it in mm or cm?)",
    ),
    "an error of a formula": ("id;x_m;y_m\n0;#DIV/0!;2\n", "line 2, x_m is '#DIV/0!', expected a number"),
    "a unit in a cell": ("id,x_m,y_m\n0,1.5 m,2\n", "line 2, x_m is '1.5 m', expected a number"),
    "a column twice, also one that nobody asked for": (
        "id,x_m,note,y_m,note\n0,1,a,2,b\n", "line 1, column 'note' appears twice",
    ),
    "a cell without end": ('id,x_m,y_m\n0,"1,2\n', "line 2 is no row of a table"),
    "a header without end": ('"id,x_m,y_m' + "x" * 200_000, "line 1 is no header of a table"),
    "a row twice": ("id,x_m,y_m\n0,1,2\n0,3,4\n", "line 3, id '0' appears twice, first in line 2"),
    "noise": (bytes(range(256)), "is not a text file (line "),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_what_cannot_be_meant_is_named_by_line_and_column(what):
    text, sentence = BAD[what]
    data = text if isinstance(text, bytes) else text.encode()
    with pytest.raises(FileError) as refused:
        parse_table(data, PATH, ("x_m", "y_m"), ("id",), unique=("id",), most={"x_m": 100.0, "y_m": 100.0})
    assert str(refused.value).startswith(f"table.csv: {sentence}")
    assert len(str(refused.value)) < 300
