"""The compiled core for tests: that of the tree, or a fresh one where that is stale."""

from pathlib import Path

import pytest

from groundstation.core.build import CoreBuildError, compile_core
from groundstation.core.library import CoreError, load_core


@pytest.fixture(scope="session")
def compiled_core(request, tmp_path_factory):
    chosen = request.config.getoption("--core-library")
    if chosen:
        return load_core(Path(chosen))
    try:
        return load_core()
    except CoreError:  # not compiled, or the sources changed since; perhaps even since this process loaded it
        pass
    try:
        return load_core(compile_core(tmp_path_factory.mktemp("core") / "core.so"))
    except CoreBuildError as error:
        pytest.skip(f"no compiled core to test: {error}")  # no compiler: the NumPy code is what runs there
