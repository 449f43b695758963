"""One process under the launcher's care: how it is started, heard, and ended."""

import contextlib
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from typing import IO

FIRST_BACK_OFF_S, LAST_BACK_OFF_S, PROVEN_S = 0.25, 8.0, 20.0
REFUSAL = 2
"""Exit code of a child that cannot do what it is told; its last line on stderr says why."""

_LAST_WORDS_S = 0.3


class Child:
    """A child process with a session of its own, so that Ctrl-C reaches the launcher alone.

    Args:
        name: In the plan.

    Attributes:
        is_ready: It has said so, and not gone since.
        has_been_ready: It has said so once, in this life or an earlier one.
        restarts: How often it was started again.
        restart_at_s: When it is to be started again; None while it runs.
        last_heard_s: Its last sign of life, 0 before the first.
        started_s: Of its present life.
        said: Lines of its stdout, where that is read.
        complaints: Lines of its stderr that nobody has read yet.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.is_ready = False
        self.has_been_ready = False
        self.restarts = 0
        self.restart_at_s: float | None = None
        self.last_heard_s = 0.0
        self.started_s = 0.0
        self.said: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.complaints: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._back_off_s = FIRST_BACK_OFF_S
        self._popen: subprocess.Popen[bytes] | None = None
        self._readers: list[threading.Thread] = []
        self._last_words: deque[str] = deque(maxlen=1)

    @property
    def state(self) -> str:
        """``ready``, ``starting`` or ``waiting`` for its next start."""
        if self.restart_at_s is not None:
            return "waiting"
        return "ready" if self.is_ready else "starting"

    @property
    def pid(self) -> int | None:
        """Of the process; None before the first start."""
        return None if self._popen is None else self._popen.pid

    @property
    def has_ended(self) -> bool:
        """Whether it was started and runs no more."""
        return self._popen is not None and self._popen.poll() is not None

    @property
    def has_refused(self) -> bool:
        """Whether it ended with a sentence about what it was told, before it was ever ready."""
        return self.has_ended and self._code == REFUSAL and not self.restarts and not self.is_ready

    @property
    def last_words(self) -> str:
        """Its last line on stderr; empty if it said nothing."""
        for reader in self._readers:
            reader.join(_LAST_WORDS_S)
        return self._last_words[0] if self._last_words else ""

    def start(self, arguments: list[str]) -> None:
        """Start ``python`` with these arguments; stdin stays open for as long as the launcher lives."""
        self._popen = subprocess.Popen(
            [sys.executable, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )
        self.is_ready = False
        self.restart_at_s = None
        self.last_heard_s = 0.0  # judged only from its first sign of life on
        self.started_s = time.monotonic()
        self._last_words.clear()
        self.said = queue.SimpleQueue()
        self._readers = [
            self._read(self._popen.stdout, self.said, None),
            self._read(self._popen.stderr, self.complaints, self._last_words),
        ]

    def tell(self, line: bytes) -> None:
        """Write a line to its stdin; where it has ended, that is noticed elsewhere."""
        if self._popen is not None and self._popen.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._popen.stdin.write(line)
                self._popen.stdin.flush()

    def back_off(self, now_s: float) -> float:
        """Set the moment of the next start; return the wait, which doubles unless the last life was long."""
        if now_s - self.started_s > PROVEN_S:
            self._back_off_s = FIRST_BACK_OFF_S
        wait_s = self._back_off_s
        self.restart_at_s = now_s + wait_s
        self._back_off_s = min(2 * wait_s, LAST_BACK_OFF_S)
        self.is_ready = False
        return wait_s

    def how_it_ended(self) -> str:
        """For people, its last words included."""
        code = self._code
        how = f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
        words = self.last_words if code > 0 else ""
        return f"{how} ({words})" if words else how

    def ask_to_end(self) -> None:
        """Send SIGTERM if it runs."""
        if self._popen is not None and self._popen.poll() is None:
            self._popen.terminate()

    def wait(self, until_s: float) -> None:
        """Wait for its end until a moment of the monotonic clock."""
        if self._popen is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):  # it is killed at the end
                self._popen.wait(timeout=max(0.0, until_s - time.monotonic()))

    def kill(self) -> None:
        """End it at once, whatever it does; it may then be started again."""
        if self._popen is not None and self._popen.poll() is None:
            self._popen.kill()
            self._popen.wait()

    def release(self) -> None:
        """Kill it if it still runs, and close its pipes."""
        if self._popen is None:
            return
        self.kill()
        if self._popen.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._popen.stdin.close()
        for reader in self._readers:
            reader.join(_LAST_WORDS_S)  # a grandchild may hold the other end: its thread is a daemon

    @property
    def _code(self) -> int:
        return 0 if self._popen is None or self._popen.returncode is None else self._popen.returncode

    def _read(
        self, pipe: IO[bytes] | None, lines: queue.SimpleQueue[str], newest: deque[str] | None
    ) -> threading.Thread:
        assert pipe is not None

        def read() -> None:
            with pipe:
                for raw in pipe:
                    line = raw.decode(errors="replace").rstrip()
                    lines.put(line)
                    if newest is not None and line:
                        newest.append(line)

        thread = threading.Thread(target=read, name=f"{self.name} output", daemon=True)
        thread.start()
        return thread
