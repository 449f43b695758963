"""The tables as text for a terminal and as Markdown for the page of benchmarks: one table per subject.

Each subject keeps the circumstances under which it was measured, so that subjects can be measured one by
one, on a quiet machine, without touching the others' figures.
"""

import os
import platform
import re
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bench.rows import Row
from groundstation.core.library import default_core

HEAD = ("what", "limit", "measured", "ok")
BEGIN, END = "<!-- bench:begin -->", "<!-- bench:end -->"
_SECTION = re.compile(r"^### (.+)$", re.MULTILINE)


def text(rows: Sequence[Row]) -> str:
    """Aligned columns, `` | `` between them."""
    lines = [HEAD, *(row.cells for row in rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(HEAD))]
    return "\n".join(
        " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def markdown(rows: Sequence[Row]) -> str:
    """A table of Markdown."""
    lines = [HEAD, ("---",) * len(HEAD), *(row.cells for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def machine() -> str:
    """Date, machine and core, as they stand before a subject's options."""
    return (
        f"{time.strftime('%Y-%m-%d')}, {_processor()}, {os.cpu_count()} cores, {platform.system()} "
        f"{platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}, "
        f"{default_core().name}"
    )


def section(reported: str, rows: Sequence[Row]) -> str:
    """What stands below a subject's heading: circumstances and table."""
    return f"{reported}\n\n{markdown(rows)}"


def subjects(reported: str) -> list[str]:
    """Subjects that a page has tables of, in its order."""
    return _SECTION.findall(reported.partition(BEGIN)[2].partition(END)[0])


def write(page: Path, measured: Mapping[str, str], order: Sequence[str]) -> None:
    """Put the sections between the marks of a page, atomically; subjects not measured stay as they are.

    Args:
        page: Markdown with the two marks.
        measured: Subject to its section.
        order: Every subject there is; sections of any other are dropped from the page.

    Raises:
        ValueError: The page lacks the marks.
    """
    before, begin, rest = page.read_text().partition(BEGIN)
    found, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"{page} needs the marks {BEGIN} and {END}")
    parts = _SECTION.split(found)[1:]
    sections = dict(zip(parts[::2], (part.strip("\n") for part in parts[1::2]), strict=True)) | dict(measured)
    body = "\n\n".join(f"### {name}\n\n{sections[name]}" for name in order if name in sections)
    part = page.with_name(page.name + ".part")
    part.write_text(f"{before}{BEGIN}\n{body}\n{END}{after}")
    part.replace(page)


def _processor() -> str:
    """Name of the processor where the system tells, else of its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.machine())
