"""Compile groundstation/core: as the build hook of the package, and by hand or make.

    python tools/build_core.py

A source tree keeps its core in ``build/core``; a wheel gets its own, compiled outside the tree.
"""

import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_ROOT = Path(__file__).resolve().parents[1]
if str(_ROOT) not in sys.path:
    sys.path.insert(0, str(_ROOT))  # the package is being built: nothing of it is installed yet
sys.dont_write_bytecode = True

from groundstation.core.build import CoreBuildError, compile_core, compiler  # noqa: E402
from groundstation.core.sources import INTERFACE, LIBRARY, built_folder, is_fresh  # noqa: E402

_ZIG_LOCK = _ROOT / "tools" / "requirements-zig.lock"


class CoreBuildHook(BuildHookInterface[Any]):
    """Compiles the core for an editable install, or into the wheel of this platform."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """What an isolated build needs besides: a compiler, where the machine has none."""
        try:
            compiler()
        except CoreBuildError:
            return [_ZIG_LOCK.read_text().split()[0]]
        return []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if self.target_name != "wheel":
            return
        if version == "editable":
            build()
            return
        self._made_in = tempfile.TemporaryDirectory()
        made = compile_core(Path(self._made_in.name))
        for name in (LIBRARY, INTERFACE):
            build_data["force_include"][str(made / name)] = f"groundstation/core/{name}"
        build_data["pure_python"] = False
        # Plain C without Python's own interface: one wheel for every Python of this platform.
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["tag"] = f"py3-none-{platform}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        if self.target_name == "wheel" and version != "editable":
            self._made_in.cleanup()


def build() -> None:
    """Compile the core of the source tree unless it is fresh."""
    if not is_fresh(built_folder()):
        compile_core(built_folder())


if __name__ == "__main__":
    try:
        build()
    except CoreBuildError as error:
        raise SystemExit(f"The core cannot be compiled: {error}") from error
