"""A small text that outlives processes: one file, read once when it is opened, overwritten in place."""

import errno
import os
import threading
import time
from pathlib import Path

from drivers.errors import DeviceError

BLOCK_BYTES = 4096
"""Of the file: one block, so that a write is whole or not there, and needs no new room on a full disk."""
SYNC_DELAY_S = 0.2
"""Forcing a file to the disk makes writes wait; so it is done when a change is this old."""


class MemoryFile:
    """Keeps one text on disk.

    The file is handed to the system at once and so outlives the end of the process, however it ends. That
    takes microseconds where replacing a file takes up to tens of milliseconds. It is forced to the disk in a
    thread, against loss of power.

    Args:
        path: Of the file; its folder must be there.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._kept: str | None = None
        self._is_read = False
        self._handle = -1
        self._ending = threading.Event()
        self._changed = threading.Event()
        self._keeper: threading.Thread | None = None

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
            text = self._path.read_text(encoding="utf-8").rstrip(" ")
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
        block = text.encode().ljust(BLOCK_BYTES)
        try:
            if len(block) == BLOCK_BYTES and self._is_open():
                written = os.pwrite(self._handle, block, 0)
                if written != BLOCK_BYTES:  # as a limit or a full disk allows
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            else:
                self._replace(block)
        except OSError as error:
            raise DeviceError(f"{self._path} cannot be written: {error.strerror or error}") from error
        self._kept = text
        self._changed.set()
        if self._keeper is None:
            self._keeper = threading.Thread(target=self._keep, name="memory", daemon=True)
            self._keeper.start()

    def _is_open(self) -> bool:
        """Whether the file is open, still there, and of one block."""
        if self._handle < 0:
            return False
        found = os.fstat(self._handle)
        return found.st_nlink > 0 and found.st_size == BLOCK_BYTES

    def _replace(self, block: bytes) -> None:
        """Write a new file and put it in the place of the old one."""
        partial = self._path.with_suffix(".part")
        partial.write_bytes(block)
        handle = os.open(partial, os.O_RDWR)
        try:
            partial.replace(self._path)
        except OSError:
            os.close(handle)
            raise
        before, self._handle = self._handle, handle
        if before >= 0:
            os.close(before)

    def _keep(self) -> None:
        """Force changes to the disk, those of a while at once."""
        while not self._ending.is_set():
            self._changed.wait()
            self._ending.wait(SYNC_DELAY_S)
            self._changed.clear()
            self._force()

    def _force(self) -> None:
        """By a handle of its own: the other one may be replaced meanwhile."""
        try:
            handle = os.open(self._path, os.O_RDONLY)
        except FileNotFoundError:  # removed meanwhile
            return
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

    def wake(self) -> None:
        """Let a waiting ``read`` return, and the thread end."""
        self._ending.set()
        self._changed.set()
