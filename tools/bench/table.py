"""The table as text for a terminal and as Markdown for the page of benchmarks."""

import os
import platform
import time
from collections.abc import Sequence
from pathlib import Path

from bench.rows import Row

HEAD = ("what", "limit", "measured", "ok")
BEGIN, END = "<!-- bench:begin -->", "<!-- bench:end -->"


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


def circumstances(unit_s: float, live_minutes: float, seeds: int) -> str:
    """Date, machine and unit, one sentence."""
    return (
        f"{time.strftime('%Y-%m-%d')}, {_processor()}, {os.cpu_count()} cores, {platform.system()} "
        f"{platform.machine()}, Python {platform.python_version()}; unit {1e3 * unit_s:.1f} ms of CPU; "
        f"{live_minutes:g} min live, {seeds} seeds."
    )


def write(page: Path, rows: Sequence[Row], said: str) -> None:
    """Put the table between the marks of a page, atomically.

    Raises:
        ValueError: The page lacks the marks.
    """
    before, begin, rest = page.read_text().partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"{page} needs the marks {BEGIN} and {END}")
    part = page.with_name(page.name + ".part")
    part.write_text(f"{before}{BEGIN}\n{said}\n\n{markdown(rows)}\n{END}{after}")
    part.replace(page)


def _processor() -> str:
    """Name of the processor where the system tells, else of its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.machine())
