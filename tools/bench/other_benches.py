"""Benches that live in scripts of their own and join the table.

A script joins by its name here. It is run without arguments; each line of its output that has the form
``what | limit | measured | ok`` is a row (``ok``: yes, no, or nothing where there is no limit), every other
line is progress.
"""

import subprocess
import sys

from bench.rows import ROOT, Bench, Row

SCRIPTS = ("bench_star_tracker.py", "bench_fusion.py")
_VERDICTS = {"yes": True, "no": False, "": None}


def parse_row(line: str) -> Row | None:
    """The row of a line, None for any other line."""
    line = line.strip()
    if line.startswith("|"):  # as a table of Markdown
        line = line[1:].removesuffix("|")
    cells = [cell.strip() for cell in line.split("|")]
    if len(cells) != 4 or cells[3].lower() not in _VERDICTS:
        return None
    what, limit, measured, verdict = cells
    return Row(what, limit, measured, _VERDICTS[verdict.lower()])


def measure(bench: Bench) -> list[Row]:
    """Rows of every script that is there."""
    rows = []
    for name in SCRIPTS:
        script = ROOT / "tools" / name
        if not script.exists():
            continue
        with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            for line in process.stdout:
                row = parse_row(line)
                if row is None:
                    bench.say(f"{name}: {line.strip()[:100]}")
                else:
                    rows.append(row)
        if process.returncode not in (0, 1):
            rows.append(Row(name, "", f"ended with code {process.returncode}", ok=False))
    return rows
