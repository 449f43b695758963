"""Name and version of this program, as recordings carry them."""

from importlib.metadata import PackageNotFoundError, version

from groundstation.core.library import default_core


def software() -> str:
    """``groundstation``, the version of the installed package, and the core by the hash of its sources.

    Another core may round otherwise: a replay elsewhere has to know.
    """
    try:
        release = version("groundstation")
    except PackageNotFoundError:
        release = "(not installed)"
    return f"groundstation {release}, {default_core().name}"
