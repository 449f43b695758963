"""A small text that outlives its process: the edge of a port that keeps one, and where it lies."""

from collections.abc import Iterable
from pathlib import Path

from groundstation.declarations.port import READ_TIMEOUT_S, Edge

EXPECTED = "expected"
"""Behind the folder's address and a question mark: a process that starts again must find what was kept."""


def file_at(address: object, name: str) -> Path:
    """The file of a name in the folder that an address names."""
    return Path(str(address).partition("?")[0]) / f"{name}.json"


class MemoryEdge(Edge):
    """A small text on disk: what was kept is read once, what is written replaces it.

    Args:
        path: Of the file.
        is_expected: Whether it is a trouble that nothing is there.
    """

    def __init__(self, path: Path, *, is_expected: bool) -> None:
        from drivers.memory_file import MemoryFile

        self._path, self._is_expected = path, is_expected
        self._file = MemoryFile(path)

    def read(self) -> Iterable[tuple[int, object]]:
        found = self._file.read(READ_TIMEOUT_S)
        if found is None:
            return ()
        stamp_ns, text, trouble = found
        if self._is_expected and not text:
            trouble = trouble or f"{self._path} is gone or empty: what was kept there is lost"
        return ((stamp_ns, (text, trouble)),)

    def write(self, data: object) -> None:
        assert isinstance(data, str)
        self._file.write(data)

    def wake(self) -> None:
        self._file.wake()

    def close(self) -> None:
        self._file.wake()
