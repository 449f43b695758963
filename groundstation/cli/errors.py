"""The error that commands raise for wrong input: one sentence on stderr, exit code 2, no traceback."""

from groundstation.declarations.errors import UsageError

__all__ = ["UsageError"]
