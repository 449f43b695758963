"""A small text that outlives processes: one file, read once when it is opened, replaced as a whole."""

import os
import threading
import time
from pathlib import Path

from drivers.errors import DeviceError


class MemoryFile:
    """Keeps one text on disk.

    The file is handed to the system at once and so outlives the end of the process, however it ends; it is
    forced to the disk in a thread, so that a slow disk delays nobody.

    Args:
        path: Of the file; its folder must be there.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._kept: str | None = None
        self._is_read = False
        self._ending = threading.Event()

    def read(self, timeout_s: float) -> tuple[int, str, str] | None:
        """When, the text (empty where there is no file), and why it cannot be read (empty if it can).

        The first call answers at once; later ones wait and return None.
        """
        if self._is_read:
            self._ending.wait(timeout_s)
            return None
        self._is_read = True
        text, trouble = "", ""
        try:
            text = self._path.read_text(encoding="utf-8")
        except FileNotFoundError:
            pass
        except (OSError, UnicodeDecodeError) as error:
            trouble = f"{self._path} cannot be read: {error}"
        return time.monotonic_ns(), text, trouble

    def write(self, text: str) -> None:
        """Replace what is kept.

        Raises:
            DeviceError: The file cannot be written.
        """
        if text == self._kept:
            return
        partial = self._path.with_suffix(".part")
        try:
            partial.write_text(text, encoding="utf-8")
            partial.replace(self._path)
        except OSError as error:
            raise DeviceError(f"{self._path} cannot be written: {error.strerror or error}") from error
        self._kept = text
        threading.Thread(target=self._force, daemon=True).start()

    def _force(self) -> None:
        try:
            handle = os.open(self._path, os.O_RDONLY)
        except FileNotFoundError:  # replaced, or removed, meanwhile
            return
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

    def wake(self) -> None:
        """Let a waiting ``read`` return."""
        self._ending.set()
