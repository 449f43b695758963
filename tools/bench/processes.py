"""Processes of a run, as the kernel lists them."""

from pathlib import Path


def children(pid: int) -> list[int]:
    """Process numbers of a process's own children; none if it is gone."""
    try:
        tasks = list(Path(f"/proc/{pid}/task").iterdir())
    except OSError:
        return []
    return [int(child) for task in tasks for child in read(pid, f"task/{task.name}/children").split()]


def words_of(pid: int) -> list[str]:
    """Command line of a process; empty if it is gone."""
    return read(pid, "cmdline").split("\0")[:-1]


def read(pid: int, name: str) -> str:
    """A file of ``/proc/<pid>``; empty if the process is gone."""
    try:
        return Path(f"/proc/{pid}/{name}").read_text(errors="replace")
    except OSError:
        return ""
