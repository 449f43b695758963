"""A run in which every vehicle flies, for subjects that do something to it; and processes that load cores."""

import os
import queue
import re
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from bench.rows import ROOT, Bench
from groundstation.launch.running import RunningRig, find_running

LOADING = "while True: pass"
READY_S = 90.0
KEPT = 30
"""Lines that are shown where one does not come."""


class NotInTimeError(Exception):
    """A line that was waited for did not come."""


class Flying:
    """A run, its lines, and where it listens.

    Args:
        process: The launcher, its output piped.
        bench: Takes its lines.
    """

    def __init__(self, process: subprocess.Popen[str], bench: Bench) -> None:
        self.process = process
        self._bench = bench
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._newest: deque[str] = deque(maxlen=KEPT)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line.strip())

    @property
    def rig(self) -> RunningRig:
        """Where it listens."""
        (found,) = [run for run in find_running() if run.pid == self.process.pid]
        return found

    def wait_for(self, pattern: str, groups: set[str] | None = None, within_s: float = READY_S) -> str:
        """Wait for a line with the pattern; where groups are given, for one with each as its first group.

        Returns:
            The first group of the last line that was waited for; empty where the pattern has none.

        Raises:
            NotInTimeError: It did not come.
        """
        waiting, last_group = {""} if groups is None else set(groups), ""
        until_s = time.monotonic() + within_s
        while waiting:
            try:
                line = self._lines.get(timeout=max(0.0, until_s - time.monotonic()))
            except queue.Empty:
                last = "\n".join(self._newest)
                raise NotInTimeError(f"no line with {pattern} for {sorted(waiting)}:\n{last}") from None
            self._newest.append(line)
            self._bench.say(line[:100])
            found = re.search(pattern, line)
            if found is not None:
                last_group = found[1] if found.re.groups else ""
                waiting.discard("" if groups is None else last_group)
        return last_group


@contextmanager
def flying(bench: Bench, rig: Path, *words: str) -> Iterator[Flying]:
    """Start a run; it is ended in order afterwards."""
    command = [sys.executable, "-m", "groundstation", "run", str(rig), "--headless", *words]
    environment = os.environ | {
        "XDG_RUNTIME_DIR": str(bench.folder),
        "XDG_STATE_HOME": str(bench.folder / "state"),
    }
    os.environ["XDG_RUNTIME_DIR"] = str(bench.folder)  # where the run is looked for
    with subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        try:
            yield Flying(process, bench)
        finally:
            process.terminate()
            process.wait(30)


@contextmanager
def load(count: int) -> Iterator[None]:
    """So many processes that do nothing but compute."""
    with ExitStack() as stack:
        for _ in range(count):
            loading = stack.enter_context(subprocess.Popen([sys.executable, "-c", LOADING]))
            stack.callback(loading.kill)
        yield
