"""Compile the core, and read its header for Python: at installation, by ``make``, and in tests.

Needs a C compiler: what ``CC`` names, else ``cc``, else ``ziglang`` from the package index.
"""

import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from groundstation.core import sources
from groundstation.core.sources import FLAGS, INTERFACE, LIBRARY

SANITIZERS = (
    "-g",
    "-O1",
    "-fno-omit-frame-pointer",
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
)
# zig aims at the very machine it runs on unless told otherwise.
_ZIG = (sys.executable, "-m", "ziglang", "cc", "-mcpu=baseline")


class CoreBuildError(RuntimeError):
    """The core could not be compiled; the text gives the reason in one sentence."""


def compiler() -> tuple[str, ...]:
    """The command that compiles C here.

    Raises:
        CoreBuildError: There is none.
    """
    named = os.environ.get("CC")
    command = tuple(shlex.split(named or "cc"))
    if shutil.which(command[0]):
        return command
    if named:
        raise CoreBuildError(f"no C compiler: CC names {command[0]!r}, which is not installed")
    if importlib.util.find_spec("ziglang"):
        return _ZIG
    raise CoreBuildError(
        "no C compiler: install cc, name one by CC, or pip install -r tools/requirements-zig.lock"
    )


def compile_core(folder: Path, extra_flags: tuple[str, ...] = ()) -> Path:
    """Build into ``folder``; a library in use is replaced as a whole, never rewritten.

    Raises:
        CoreBuildError: There is no compiler, or it refused.
    """
    command = compiler()
    folder.mkdir(parents=True, exist_ok=True)
    files = [str(path) for path in sources.sources() if path.suffix == ".c"]
    with tempfile.TemporaryDirectory(dir=folder) as made_in:
        interface, library = Path(made_in, INTERFACE), Path(made_in, LIBRARY)
        named = f'-DGS_SOURCES="{sources.sources_sha256()}"'
        run = subprocess.run(
            [*command, *FLAGS, *extra_flags, named, "-o", str(library), *files, "-lm"],
            # zig keeps what it compiled; here it goes with the folder
            env={"ZIG_LOCAL_CACHE_DIR": made_in, "ZIG_GLOBAL_CACHE_DIR": made_in, **os.environ},
            capture_output=True,
            text=True,
            check=False,
        )
        if run.returncode:
            raise CoreBuildError(f"{command[0]} refused the core:\n{run.stderr.strip()}")
        _read_header(interface)
        for made in (interface, library):
            made.replace(folder / made.name)
    return folder


def _read_header(interface: Path) -> None:
    """Write what Python needs to know of ``api.h`` as a module, so that no process has to parse C."""
    from cffi import FFI  # here: who loads a core needs no parser of C

    lines = (sources.FOLDER / "api.h").read_text().splitlines(keepends=True)
    declarations = FFI()
    declarations.set_source(interface.stem, None, compiler_verbose=0)
    declarations.cdef("".join(line for line in lines if not line.startswith("#")))
    declarations.emit_python_code(str(interface))
