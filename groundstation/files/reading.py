"""Bytes and text of a file, as ``drivers.files`` reads them for the emulator, too."""

from drivers.files.reading import read_bytes, text_of

__all__ = ["read_bytes", "text_of"]
