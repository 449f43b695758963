"""Compile the core: at installation, by ``make``, and in tests with sanitizers.

Needs the machine's C compiler (``CC`` or ``cc``) and nothing else; takes a few seconds.
"""

import hashlib
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

FOLDER = Path(__file__).parent
LIBRARY = FOLDER / "_core.so"
# No -march: the library runs on every machine of its kind, and loops that gain by AVX2 carry a clone.
# No contraction, no fast-math: the same sums in the same order on every machine.
FLAGS = (
    *("-std=c11", "-O3", "-fPIC", "-shared", "-fvisibility=hidden", "-fno-math-errno", "-fno-trapping-math"),
    *("-ffp-contract=off", "-Wall", "-Wextra"),
)
SANITIZERS = (
    "-g",
    "-O1",
    "-fno-omit-frame-pointer",
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
)


class CoreBuildError(RuntimeError):
    """The core could not be compiled; the text says why in one sentence."""


def sources() -> list[Path]:
    """All sources of the core, in a fixed order."""
    return sorted([*FOLDER.glob("*.c"), *FOLDER.glob("*.h")])


def sources_sha256() -> str:
    """Hash of all sources and flags: what a library must have been made of."""
    digest = hashlib.sha256(" ".join(FLAGS).encode())
    for path in sources():
        content = path.read_bytes()
        digest.update(f"\n{path.name} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()


def is_fresh(library: Path = LIBRARY) -> bool:
    """Whether the library is there and was made of the present sources."""
    return library.exists() and sources_sha256().encode() in library.read_bytes()


def compile_core(library: Path = LIBRARY, extra_flags: tuple[str, ...] = ()) -> Path:
    """Compile all sources to ``library``; a library in use is replaced as a whole, never rewritten.

    Raises:
        CoreBuildError: There is no compiler, or it refused.
    """
    command = shlex.split(os.environ.get("CC", "cc"))
    if shutil.which(command[0]) is None:
        raise CoreBuildError(f"no C compiler: {command[0]!r} is not installed (set CC to name another)")
    sha256 = sources_sha256()
    files = [str(path) for path in sources() if path.suffix == ".c"]
    handle, partial = tempfile.mkstemp(suffix=".so", dir=library.parent)
    os.close(handle)
    try:
        run = subprocess.run(
            [*command, *FLAGS, *extra_flags, f'-DGS_SOURCES="{sha256}"', "-o", partial, *files, "-lm"],
            capture_output=True,
            text=True,
            check=False,
        )
        if run.returncode:
            raise CoreBuildError(f"{command[0]} refused the core:\n{run.stderr.strip()}")
        os.chmod(partial, 0o755)  # noqa: PTH101 - mkstemp hides its file from other users
        os.replace(partial, library)  # noqa: PTH105 - atomic, partial is a plain name
    finally:
        Path(partial).unlink(missing_ok=True)
    return library
