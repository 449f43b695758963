"""Name and version of this program, as recordings carry them."""

from importlib.metadata import PackageNotFoundError, version


def software() -> str:
    """``groundstation`` and the version of the installed package."""
    try:
        return f"groundstation {version('groundstation')}"
    except PackageNotFoundError:
        return "groundstation (not installed)"
