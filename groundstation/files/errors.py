"""What a file that cannot be used raises."""

from drivers.files.errors import FileError

__all__ = ["FileError"]
