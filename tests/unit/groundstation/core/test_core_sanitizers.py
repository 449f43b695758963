"""The tests of the core again, with a library that watches its own memory and arithmetic."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.core.build import SANITIZERS, CoreBuildError, compile_core

TESTS = Path(__file__).parents[1]


def _compiler_file(name: str) -> str:
    compiler = os.environ.get("CC", "cc").split()
    return subprocess.check_output([*compiler, f"-print-file-name={name}"], text=True).strip()


@pytest.mark.slow
def test_no_wrong_memory_and_no_undefined_arithmetic(tmp_path: Path) -> None:
    try:
        compile_core(tmp_path, SANITIZERS)
    except CoreBuildError as error:
        pytest.skip(f"no sanitizers here: {error}")  # they come with the compiler, not with us
    # Other extensions throw C++ exceptions, which the sanitizer has to know from the beginning.
    preload = " ".join(_compiler_file(name) for name in ("libasan.so", "libstdc++.so.6"))
    command = (sys.executable, "-m", "pytest", "-qxs", "-pno:cacheprovider", "-m", "core and not slow")
    run = subprocess.run(
        [*command, "--core-folder", tmp_path, TESTS],
        # Python itself leaves memory to the system at its end; the core allocates nothing.
        env={**os.environ, "LD_PRELOAD": preload, "ASAN_OPTIONS": "detect_leaks=0"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]
    assert " passed" in run.stdout
