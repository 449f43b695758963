"""Compile groundstation/core: as the build hook of the package, and by hand or make.

    python tools/build_core.py

A machine without a C compiler gets one line, and the slower NumPy code.
"""

import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_ROOT = Path(__file__).resolve().parents[1]
if str(_ROOT) not in sys.path:
    sys.path.insert(0, str(_ROOT))  # the package is being built: nothing of it is installed yet

from groundstation.core.build import LIBRARY, CoreBuildError, compile_core, is_fresh  # noqa: E402


class CoreBuildHook(BuildHookInterface[Any]):
    """Compiles the core into the tree, and into the wheel of this platform."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if self.target_name != "wheel" or not build():
            return
        build_data["artifacts"].append(str(LIBRARY.relative_to(_ROOT)))
        build_data["pure_python"] = False
        if version != "editable":
            # Plain C without Python's own interface: one wheel for every Python of this platform.
            platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            build_data["tag"] = f"py3-none-{platform}"


def build() -> bool:
    """Compile unless fresh; say so when it cannot be done."""
    try:
        if not is_fresh():
            compile_core()
    except CoreBuildError as error:
        print(f"The core is not compiled, the slower NumPy code will be used: {error}", file=sys.stderr)
        return False
    return True


if __name__ == "__main__":
    build()
