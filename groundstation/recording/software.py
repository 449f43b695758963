"""Name and version of this program, as recordings carry them."""

from importlib.metadata import PackageNotFoundError, version

from groundstation.core.library import default_core


def software() -> str:
    """``groundstation``, the version of the installed package, and which code did the heavy work.

    Compiled core and NumPy agree within rounding, not bit for bit: a replay elsewhere has to know.
    """
    try:
        release = version("groundstation")
    except PackageNotFoundError:
        release = "(not installed)"
    return f"groundstation {release}, {default_core().name}"
