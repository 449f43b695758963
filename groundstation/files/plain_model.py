"""The base of all tables that people write."""

from drivers.files.plain_model import PlainModel

__all__ = ["PlainModel"]
