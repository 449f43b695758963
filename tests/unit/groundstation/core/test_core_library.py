import shutil
from pathlib import Path

import pytest

from groundstation.core import build
from groundstation.core.build import CoreBuildError, compile_core, is_fresh
from groundstation.core.library import PURE, CoreError, load_core


@pytest.fixture
def other_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("core.h", "sources.c"):
        shutil.copy(build.FOLDER / name, tmp_path)
    monkeypatch.setattr(build, "FOLDER", tmp_path)
    return tmp_path


def test_a_library_knows_its_sources(other_sources: Path) -> None:
    library = compile_core(other_sources / "core.so", ("-Werror",))
    assert is_fresh(library)
    core = load_core(library)
    assert core.is_compiled
    assert core.name == f"compiled core {build.sources_sha256()[:8]}"
    with pytest.raises(CoreError, match="no function gs_nothing"):
        core.function("gs_nothing", None)


def test_a_stale_library_is_refused(other_sources: Path) -> None:
    library = compile_core(other_sources / "core.so")
    (other_sources / "sources.c").write_text((other_sources / "sources.c").read_text() + "\n")
    assert not is_fresh(library)
    with pytest.raises(CoreError, match="compiled from other sources"):
        load_core(library)


def test_what_is_no_library_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CoreError, match="there is no"):
        load_core(tmp_path / "core.so")
    (tmp_path / "core.so").write_text("not a library")
    with pytest.raises(CoreError, match="not a core that this machine can load"):
        load_core(tmp_path / "core.so")


def test_without_a_compiler_it_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(CoreBuildError, match="no C compiler"):
        compile_core(tmp_path / "core.so")
    assert list(tmp_path.iterdir()) == []


def test_a_refusing_compiler_leaves_nothing(other_sources: Path) -> None:
    (other_sources / "broken.c").write_text("int broken(")
    with pytest.raises(CoreBuildError, match=r"broken\.c"):
        compile_core(other_sources / "core.so")
    assert not list(other_sources.glob("*.so"))


def test_pure_numpy_has_no_functions() -> None:
    assert not PURE.is_compiled
    with pytest.raises(CoreError, match="is_compiled"):
        PURE.function("gs_sources", None)
