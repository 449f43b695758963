"""Bytes and text of a file, refused in one sentence."""

import codecs
import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

from drivers.files.errors import FileError

_MARKS = (  # UTF-32 first: its mark begins with that of UTF-16
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_UNPACK, _EXPORT = "unpack it", "save what it holds as text (a table as CSV UTF-8)"
_NO_TEXT = {
    b"PK\x03\x04": ("a workbook (.xlsx, .ods)", "save it as CSV UTF-8, or unpack it if it is an archive"),
    b"PK\x05\x06": ("an empty archive (.zip)", "make it again"),
    b"\xd0\xcf\x11\xe0": ("a workbook (.xls)", "save it as CSV UTF-8"),
    b"\x1f\x8b": ("compressed (.gz)", _UNPACK),
    b"BZh": ("compressed (.bz2)", _UNPACK),
    b"\xfd7zXZ\x00": ("compressed (.xz)", _UNPACK),
    b"\x28\xb5\x2f\xfd": ("compressed (.zst)", _UNPACK),
    b"7z\xbc\xaf\x27\x1c": ("compressed (.7z)", _UNPACK),
    b"\x89PNG": ("a picture (.png)", _EXPORT),
    b"\xff\xd8\xff": ("a picture (.jpg)", _EXPORT),
    b"%PDF-": ("a document (.pdf)", _EXPORT),
    b"\x89HDF": ("HDF5 (.h5, .mat)", _EXPORT),
    b"\x93NUMPY": ("an array of NumPy (.npy)", _EXPORT),
    b"PAR1": ("a table of Parquet", _EXPORT),
    b"\x89MCAP": ("a recording (.mcap)", "give it where a recording is expected"),
}
_LOOKED_AT = 4096  # of bytes, to tell UTF-16 without a mark


def open_file(path: Path) -> BinaryIO:
    """Open a file for reading; of a pipe or a device nobody knows when it ends, or whether it begins.

    Raises:
        OSError: It is missing, cannot be read, or is a pipe, a device or a socket.
    """
    mode = path.stat().st_mode  # before it is opened: a pipe would wait for its other end
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # of a folder the system has a sentence of its own
        what = {stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}.get(stat.S_IFMT(mode), "a device")
        raise OSError(errno.EINVAL, f"it is {what}, expected a file", str(path))
    return path.open("rb")


def read_bytes(path: Path) -> bytes:
    """Read a whole file.

    Raises:
        FileError: It is missing or cannot be read.
    """
    try:
        with open_file(path) as file:
            return file.read()
    except IsADirectoryError as error:
        raise FileError(f"{path}: is a folder, expected a file; name one in it.") from error
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error}).") from error
    except ValueError as error:  # a NUL in the name
        raise FileError(f"{str(path)!r}: cannot be read ({error}).") from error


def path_of(text: str) -> Path:
    """The path that a file states, whatever the locale: names are UTF-8 in files and on disks."""
    return Path(os.fsdecode(text.encode(errors="surrogateescape")))


def text_of_path(path: Path) -> str:
    """A path as files state it."""
    return os.fsencode(path).decode(errors="replace")


def text_of(data: bytes, path: Path) -> str:
    """Decode UTF-8, or what a byte order mark or the zeros of ASCII in UTF-16 show it to be.

    Lines end with a newline alone.

    Raises:
        FileError: It is no text.
    """
    mark, encoding = next(((mark, name) for mark, name in _MARKS if data.startswith(mark)), (b"", ""))
    if not encoding:
        encoding = _unmarked(data[:_LOOKED_AT])
    for head, (what, advice) in _NO_TEXT.items():
        if data.startswith(head):
            raise FileError(f"{path}: is {what} and no text; {advice}.")
    try:
        text = data[len(mark) :].decode(encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        name = encoding[: encoding.index("-", 4)] if encoding.count("-") > 1 else encoding
        raise FileError(
            f"{path}: is not a text file (line {line} is no {name.upper()}); save it as UTF-8."
        ) from error
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _unmarked(head: bytes) -> str:
    """UTF-8, unless every other byte is the zero that ASCII has in UTF-16."""
    half = len(head) // 2
    if half and head[1::2].count(0) > 0.8 * half and head[0::2].count(0) < 0.2 * half:
        return "utf-16-le"
    if half and head[0::2].count(0) > 0.8 * half and head[1::2].count(0) < 0.2 * half:
        return "utf-16-be"
    return "utf-8"
