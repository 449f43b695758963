"""Bytes and text of a file, as ``drivers.files`` reads them for the emulator, too."""

from drivers.files.reading import open_file, path_of, read_bytes, text_of, text_of_path

__all__ = ["open_file", "path_of", "read_bytes", "text_of", "text_of_path"]
