"""A rig in flight in processes of its own, and which process is which group's. Linux only: ``/proc``."""

import os
import queue
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.processes import children, read

READY = "all processes are ready"
READY_WITHIN_S, ENDED_WITHIN_S = 60.0, 20.0
EMULATOR = "emulator"
LAUNCHER, FORK_SERVER = "launcher", "fork server"
GROUPS = (LAUNCHER, FORK_SERVER, "recorder", "commands", "flights", "skies", "station", "others")
"""Of the station; the emulated laboratory stands for hardware and is counted apart."""


class HouseError(Exception):
    """A run did not become ready, lost a process or did not end well; the text says what it printed last."""


class FlownRig:
    """A live run whose processes are all ready.

    Attributes:
        ready_s: From the start of the command until it printed that all processes are ready.
    """

    def __init__(
        self, checkout: Path, process: "subprocess.Popen[str]", ready_s: float, lines: "_Lines"
    ) -> None:
        self._checkout, self._process, self._lines = checkout, process, lines
        self.ready_s = ready_s

    def groups(self) -> dict[str, tuple[int, ...]]:
        """Process numbers by group; a child of the emulator is the emulator's."""
        return _groups(self._process.pid)

    def check_still(self, groups: dict[str, tuple[int, ...]]) -> None:
        """Raise unless these are still the processes.

        Raises:
            HouseError: One of them died or was restarted.
        """
        if self.groups() != groups:
            raise HouseError(f"{self._checkout}: a process died or was restarted\n{self._lines.newest()}")


@contextmanager
def flown(checkout: Path, rig: Path) -> Iterator[FlownRig]:
    """Fly a rig headless and recorded, with the interpreter of the checkout.

    Args:
        checkout: Where ``.venv`` and the rig are.
        rig: Rig file, relative to the checkout.

    Raises:
        HouseError: The run did not become ready, or did not end well.
    """
    with tempfile.TemporaryDirectory(prefix="house_") as folder:
        command = [str(checkout / ".venv" / "bin" / "groundstation"), "run", str(checkout / rig)]
        command += ["--headless", "--record", f"{folder}/run.mcap"]
        if (checkout / "groundstation" / "console").is_dir():
            command.append("--no-console")  # earlier commits have none; its own subject measures it
        begin_s = time.monotonic()
        process = subprocess.Popen(
            command,
            cwd=checkout,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=_environment(checkout),
        )
        lines = _Lines(process)
        try:
            yield FlownRig(checkout, process, lines.wait_for(READY, READY_WITHIN_S) - begin_s, lines)
        finally:
            process.terminate()
            try:
                code = process.wait(ENDED_WITHIN_S)
            except subprocess.TimeoutExpired:
                process.kill()
                code = process.wait()
            lines.close()
    if code:
        raise HouseError(f"{checkout}: the run ended with code {code}\n{lines.newest()}")


def pss_mb(pid: int) -> float:
    """Memory of a process in MB; pages that it shares count in parts."""
    for line in read(pid, "smaps_rollup").splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) / 1024
    return 0.0


def _environment(checkout: Path) -> dict[str, str]:
    """Ours, without what would make one checkout import another."""
    dropped = {"PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME"}
    kept = {name: value for name, value in os.environ.items() if name not in dropped}
    # an editable install leads back to the folder that it was made in, which need not be this one
    return kept | {"PYTHONPATH": str(checkout)}


class _Lines:
    """What a process prints, read by a thread so that its pipe never fills."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process
        self._all: list[str] = []
        self._news: queue.SimpleQueue[tuple[float, str] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._all.append(line.rstrip())
            self._news.put((time.monotonic(), line))
        self._news.put(None)

    def wait_for(self, text: str, within_s: float) -> float:
        """Moment at which a line with the text came, on the monotonic clock."""
        until_s = time.monotonic() + within_s
        while (left_s := until_s - time.monotonic()) > 0:
            try:
                news = self._news.get(timeout=left_s)
            except queue.Empty:
                break
            if news is None:
                raise HouseError(f"the run ended by itself\n{self.newest()}")
            if text in news[1]:
                return news[0]
        raise HouseError(f"no line '{text}' within {within_s:g} s\n{self.newest()}")

    def newest(self) -> str:
        """The last lines, for people."""
        return "\n".join(f"  {line}" for line in self._all[-12:])

    def close(self) -> None:
        """Let the thread end."""
        self._thread.join(2.0)
        if self._process.stdout is not None and not self._thread.is_alive():
            self._process.stdout.close()


def _groups(launcher: int) -> dict[str, tuple[int, ...]]:
    """Process numbers by group; a child of the emulator is the emulator's."""
    found: dict[str, list[int]] = {LAUNCHER: [launcher]}

    def visit(pid: int, group: str | None) -> None:
        for child in children(pid):
            named = group or _group_of(child)
            found.setdefault(named, []).append(child)
            visit(child, EMULATOR if named == EMULATOR else None)

    visit(launcher, None)
    return {name: tuple(sorted(pids)) for name, pids in sorted(found.items())}


def _group_of(pid: int) -> str:
    """By the name that a process gave itself, or the last word of its command line."""
    words = read(pid, "cmdline").split("\0")
    if "firmware_emulator" in words:
        return EMULATOR
    for name in (read(pid, "comm").strip(), *reversed([word for word in words if word])):
        if name.endswith("_flight"):
            return "flights"
        if name.endswith("_sky"):
            return "skies"
        if name in GROUPS:
            return name
        if "fork" in name:
            return FORK_SERVER
    return "others"
