"""What the commands of README, docs and help leave in the project's folder is not shown by git."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
HELP = [path for room in ("groundstation", "calibration") for path in sorted((ROOT / room).rglob("*.py"))]
WRITTEN = re.compile(r"--(?:out|record|report|plot|camera-out|table-map|pictures)[ =]([\w./-]+)")
MADE = re.compile(r"groundstation demo data ([\w./-]+)|survey_laps.py ([\w./-]+)")


def targets(path):
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines() if path.suffix == ".md" else re.findall(r"Example: (.*)", text)
    for line in lines:
        if "groundstation " in line or "python examples" in line:
            yield from WRITTEN.findall(line)
            yield from (name for names in MADE.findall(line) for name in names if name)


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no working tree of git")
@pytest.mark.parametrize("path", [*PAGES, *HELP], ids=lambda path: str(path.relative_to(ROOT)))
def test_what_a_command_writes_is_ignored_by_git(path):
    for name in targets(path):
        if "/" in name and not (ROOT / name.split("/")[0]).exists() and not name.startswith(("try/", "rep")):
            continue  # of somebody's own folder
        if name.isupper():
            continue  # stands for a name
        inside = name if "." in name else f"{name}/report.json"  # of a folder, what lies in it
        done = subprocess.run(["git", "check-ignore", "-q", "--no-index", inside], cwd=ROOT, check=False)
        assert done.returncode == 0, f"{name} would be shown by git status"


def test_the_pages_name_what_they_write():
    assert {"recordings/run.mcap", "try"} <= set(targets(ROOT / "README.md"))
