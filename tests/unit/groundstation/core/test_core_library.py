import shutil
import sys
from pathlib import Path

import pytest

from groundstation.cli.main import call
from groundstation.core import build, library, sources
from groundstation.core.build import CoreBuildError, compile_core, compiler
from groundstation.core.library import CoreError, default_core, load_core
from groundstation.core.sources import INTERFACE, LIBRARY, is_fresh, sources_sha256


@pytest.fixture
def other_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("core.h", "api.h", "sources.c"):
        shutil.copy(sources.FOLDER / name, tmp_path)
    monkeypatch.setattr(sources, "FOLDER", tmp_path)
    return tmp_path


def test_a_library_knows_its_sources(other_sources: Path) -> None:
    made = compile_core(other_sources / "made", ("-Werror",))
    assert sorted(path.name for path in made.iterdir()) == [LIBRARY, INTERFACE]
    assert is_fresh(made)
    core = load_core(made)
    assert core.name == f"core {sources_sha256()[:8]}"
    assert core.lib.MAX_NODES == 64
    with pytest.raises(AttributeError, match="gs_nothing"):
        _ = core.lib.gs_nothing


def test_a_stale_library_is_refused(other_sources: Path) -> None:
    made = compile_core(other_sources / "made")
    (other_sources / "sources.c").write_text((other_sources / "sources.c").read_text() + "\n")
    assert not is_fresh(made)
    with pytest.raises(CoreError, match="compiled from other sources"):
        load_core(made)


def test_what_is_no_library_is_refused(other_sources: Path) -> None:
    with pytest.raises(CoreError, match="there is no compiled core"):
        load_core(other_sources)
    made = compile_core(other_sources / "made")
    (made / LIBRARY).unlink()
    with pytest.raises(CoreError, match="there is no compiled core"):
        load_core(made)
    (made / LIBRARY).write_text("not a library")
    with pytest.raises(CoreError, match="not a core that this machine can load"):
        load_core(made)


def test_without_a_core_commands_say_so_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(library, "built_folder", lambda: tmp_path)
    default_core.cache_clear()
    try:
        assert call(["run", "examples/rigs/two_mock_ups.toml"]) == 1
    finally:
        default_core.cache_clear()
    reported = capsys.readouterr().err
    assert reported == f"groundstation: there is no compiled core in {tmp_path}: run make, or install again\n"


def test_a_compiler_that_is_named_and_missing_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(CoreBuildError, match="CC names 'no-such-compiler'"):
        compile_core(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_without_a_compiler_zig_is_taken_and_without_zig_it_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(CoreBuildError, match=r"install cc, .*requirements-zig\.lock"):
        compiler()
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda name: name)
    assert compiler()[:4] == (sys.executable, "-m", "ziglang", "cc")


def test_a_refusing_compiler_leaves_nothing(other_sources: Path) -> None:
    (other_sources / "broken.c").write_text("int broken(")
    with pytest.raises(CoreBuildError, match=r"broken\.c"):
        compile_core(other_sources / "made")
    assert list((other_sources / "made").iterdir()) == []
