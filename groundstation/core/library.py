"""Load the compiled core."""

import functools
import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from groundstation.core.sources import INTERFACE, LIBRARY, built_folder, sources_sha256

if TYPE_CHECKING:  # a completed command line loads this, and nothing heavy
    import numpy as np
    from numpy.typing import NDArray


class CoreError(RuntimeError):
    """There is no core that can be used; the text gives the reason and what to do."""


@dataclass(frozen=True, slots=True, eq=False)
class Core:
    """The loaded core, as ``api.h`` declares it.

    Attributes:
        name: For recordings and reports: ``core 1a2b3c4d``, of its sources.
        lib: Its functions and constants.
        ffi: Makes its structures and pointers (cffi).
    """

    name: str
    lib: Any
    ffi: Any

    def doubles(self, array: "NDArray[np.float64] | None") -> Any:  # noqa: ANN401 - a pointer of cffi's
        """The numbers of an array as a function of the core takes them: whole in memory, row by row."""
        return self.ffi.NULL if array is None else self.ffi.from_buffer("double[]", array)


def load_core(folder: Path) -> Core:
    """Load a build.

    Raises:
        CoreError: It is not there, cannot be loaded, or was made of other sources than those beside it.
    """
    library, interface = folder / LIBRARY, folder / INTERFACE
    if not library.exists() or not interface.exists():
        raise CoreError(f"there is no compiled core in {folder}: run make, or install again")
    try:
        ffi = _module(interface).ffi
        lib = ffi.dlopen(str(library))
        made_of = ffi.string(lib.gs_sources()).decode()
    except (OSError, AttributeError, ImportError, SyntaxError) as error:
        raise CoreError(f"{library} is not a core that this machine can load: {error}") from error
    if made_of != sources_sha256():
        raise CoreError(
            f"{library} was compiled from other sources than those beside it: run make, or install again"
        )
    return Core(f"core {made_of[:8]}", lib, ffi)


@functools.cache
def default_core() -> Core:
    """The core of this installation, loaded once per process.

    Raises:
        CoreError: As for ``load_core``.
    """
    return load_core(built_folder())


def _module(path: Path) -> Any:  # noqa: ANN401 - generated
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is no module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
