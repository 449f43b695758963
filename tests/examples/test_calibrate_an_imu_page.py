"""Every command of `docs/how_to/calibrate_an_imu.md` is run in its order, and what the page says holds."""

import re
import shlex
import shutil
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "how_to" / "calibrate_an_imu.md"
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks():
    return [(kind, text.strip()) for kind, text in BLOCK.findall(PAGE.read_text(encoding="utf-8"))]


def residual_m(path):
    return tomllib.loads(path.read_text())["residual"]["position"]["value"]


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_every_command_of_the_page_runs(groundstation, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = 0
    for kind, text in blocks():
        if kind == "toml":  # keys that the page adds to the copied rig
            rig = tmp_path / "try" / "rig.toml"
            header, keys = text.split("\n", 1)
            assert header in rig.read_text()
            rig.write_text(rig.read_text().replace(header, f"{header}\n{keys}", 1))
            continue
        for line in text.splitlines():
            words = shlex.split(line, comments=True)
            if words[0] == "cp":
                shutil.copy(ROOT / words[1], tmp_path / words[2])
                continue
            assert words[0] == "groundstation", line
            result = groundstation(*words[1:])
            assert result.exit_code == 0, f"{line}\n{result.output}"
            run += 1
    assert run == 14
    for name in PAGE.read_text(encoding="utf-8").split("--plot ")[1:]:
        assert (tmp_path / name.split()[0]).read_bytes().startswith(b"\x89PNG")
    short, long = (residual_m(tmp_path / "try" / "flight" / f"fit_{span}s.toml") for span in (10, 20))
    assert (round(1e3 * short), round(1e3 * long)) == (6, 62)  # as the page says


def test_the_pictures_of_the_page_are_there():
    pictures = re.findall(r"!\[[^]]+\]\(([^)]+)\)", PAGE.read_text(encoding="utf-8"))
    assert len(pictures) >= 4
    for picture in pictures:
        assert (PAGE.parent / picture).resolve().is_file(), picture
