"""Bytes and text of a file, refused in one sentence."""

from pathlib import Path

from groundstation.files.errors import FileError


def read_bytes(path: Path) -> bytes:
    """Read a whole file.

    Raises:
        FileError: It is missing or cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error}).") from error


def text_of(data: bytes, path: Path) -> str:
    """Decode UTF-8, with or without a byte order mark.

    Raises:
        FileError: It is no text.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise FileError(f"{path}: is not a text file (line {line} is no UTF-8).") from error
