"""Load the compiled core, or say why not.

A function that has C beside its NumPy takes ``core: Core | None = None``: None is ``default_core()``,
``PURE`` the NumPy code.
"""

import ctypes
import functools
import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from groundstation.core.build import LIBRARY, sources_sha256


class CoreError(RuntimeError):
    """A library that cannot be used; the text says why and what to do."""


class CoreMissingError(CoreError):
    """Nothing was compiled: there was no C compiler."""


@dataclass(frozen=True, slots=True, eq=False)
class Core:
    """Which code does the work.

    Attributes:
        name: For recordings and reports: ``compiled core 1a2b3c4d`` (of its sources), or ``pure NumPy``.
        library: The loaded library; None for NumPy.
    """

    name: str
    library: ctypes.CDLL | None = None

    @property
    def is_compiled(self) -> bool:
        return self.library is not None

    def function(self, name: str, result: type[Any] | None, *arguments: type[Any]) -> Callable[..., Any]:
        """Give an exported function; arrays are passed as addresses (``c_void_p``, ``array.ctypes.data``).

        Raises:
            CoreError: There is no library, or no such function in it.
        """
        if self.library is None:
            raise CoreError("pure NumPy has no compiled functions: ask is_compiled first")
        try:
            # By item, not attribute: every caller has its own object with its own types.
            found = self.library[name]
        except AttributeError as error:
            raise CoreError(f"the compiled core has no function {name}") from error
        found.restype = result
        found.argtypes = arguments
        return found


PURE = Core("pure NumPy")


def load_core(library: Path = LIBRARY) -> Core:
    """Load a compiled library.

    Raises:
        CoreMissingError: It is not there.
        CoreError: It cannot be loaded, or was made of other sources than those beside it.
    """
    if not library.exists():
        raise CoreMissingError(f"there is no {library.name}: the core was not compiled (make compiles it)")
    try:
        loaded = ctypes.CDLL(str(library))
        said_by = loaded["gs_sources"]
    except (OSError, AttributeError) as error:
        raise CoreError(f"{library} is not a core that this machine can load: {error}") from error
    said_by.restype = ctypes.c_char_p
    said, wanted = said_by().decode(), sources_sha256()
    if not said.endswith(wanted):
        raise CoreError(
            f"{library} was compiled from other sources than those beside it: run make, or install again"
        )
    return Core(f"compiled core {wanted[:8]}", loaded)


@functools.cache
def default_core() -> Core:
    """The compiled core where there is one, else NumPy; asked once per process."""
    try:
        return load_core()
    except CoreMissingError as error:  # the installation has said so
        logging.getLogger(__name__).info("%s; using the slower NumPy code", error)
    except CoreError as error:
        logging.getLogger(__name__).warning("%s; using the slower NumPy code", error)
    return PURE
