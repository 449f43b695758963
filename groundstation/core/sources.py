"""The sources of the core, and where their build lies."""

import hashlib
from pathlib import Path

FOLDER = Path(__file__).parent
LIBRARY, INTERFACE = "_core.so", "_core_interface.py"
"""What a build consists of: the library, and what cffi read in ``api.h``."""
# No -march: the library runs on every machine of its kind, and loops that gain by AVX2 carry a clone.
# No contraction, no fast-math: the same sums in the same order on every machine.
FLAGS = (
    *("-std=c11", "-O3", "-fPIC", "-shared", "-fvisibility=hidden", "-fno-math-errno", "-fno-trapping-math"),
    *("-ffp-contract=off", "-Wall", "-Wextra"),
)


def built_folder() -> Path:
    """Where the build of these sources lies: in an installed package beside them, else in ``build/core``."""
    root = FOLDER.parents[1]
    return root / "build" / "core" if (root / "pyproject.toml").exists() else FOLDER


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


def is_fresh(folder: Path) -> bool:
    """Whether a build is there and was made of the present sources."""
    library = folder / LIBRARY
    return (
        (folder / INTERFACE).exists()
        and library.exists()
        and sources_sha256().encode() in library.read_bytes()
    )
