"""One process under the launcher's care: what is known of it, what it writes, how it is ended."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections import deque
from typing import IO, Protocol

FIRST_BACK_OFF_S, LAST_BACK_OFF_S, PROVEN_S = 0.25, 8.0, 20.0
REFUSAL = 2
"""Exit code of a child that cannot do what it is ordered; its last line on stderr gives the reason."""

_READ_BYTES, _MOST_READS = 1 << 16, 16
MOST_REMEMBERED = 256
"""Lines and ends of a process, over all its lives."""


class Process(Protocol):
    """A running process: of ``subprocess``, or forked."""

    pid: int

    @property
    def stdin(self) -> IO[bytes] | None: ...

    @property
    def stdout(self) -> IO[bytes] | None: ...

    @property
    def stderr(self) -> IO[bytes] | None: ...

    def poll(self) -> int | None: ...

    def wait(self, timeout: float | None = None) -> int: ...

    def terminate(self) -> None: ...

    def kill(self) -> None: ...


class Child:
    """A child process with a session of its own, so that Ctrl-C reaches the launcher alone.

    Args:
        name: In the plan.

    Attributes:
        is_ready: It has announced so, and not gone since.
        has_been_ready: It has announced so once, in this life or an earlier one.
        restarts: How often it was started again.
        restart_at_s: When it is to be started again, on the monotonic clock; None while it runs.
        history: Its newest lines on stderr and how its lives ended, with moments on the monotonic clock.
        last_sign_s: Its last sign of life, on the launcher's running time; None before the first.
        started_s: Of its present life, on the launcher's running time.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.is_ready = False
        self.has_been_ready = False
        self.restarts = 0
        self.restart_at_s: float | None = None
        self.last_sign_s: float | None = None
        self.started_s = 0.0
        self._back_off_s = FIRST_BACK_OFF_S
        self._began_s = 0.0
        self._process: Process | None = None
        self._output = Lines(None)
        self._complaints = Lines(None)
        self._unread: deque[str] = deque()
        self._last_words = ""
        self.history: deque[tuple[float, str]] = deque(maxlen=MOST_REMEMBERED)

    @property
    def state(self) -> str:
        """``ready``, ``starting`` or ``waiting`` for its next start."""
        if self.restart_at_s is not None:
            return "waiting"
        return "ready" if self.is_ready else "starting"

    @property
    def pid(self) -> int | None:
        """Of the process; None before the first start."""
        return None if self._process is None else self._process.pid

    @property
    def code(self) -> int | None:
        """Exit code, or minus the signal that ended it; None before the first start and while it runs."""
        return None if self._process is None else self._process.poll()

    @property
    def has_ended(self) -> bool:
        """Whether it was started and runs no more."""
        return self.code is not None

    @property
    def has_refused(self) -> bool:
        """Whether it ended with a sentence about what it was ordered, before it was ever ready."""
        return self.code == REFUSAL and not self.restarts and not self.has_been_ready

    @property
    def last_words(self) -> str:
        """Its last line on stderr; empty if it wrote nothing."""
        if self.has_ended:
            self._read_complaints()
        return self._last_words

    def adopt(self, process: Process, running_s: float) -> None:
        """Take a process that was started just now; its stdin stays open for as long as the launcher lives.

        Args:
            process: The new life of this child.
            running_s: The launcher's running time.
        """
        self._close_pipes()
        self._process = process
        self.is_ready = False
        self.restart_at_s = None
        self.last_sign_s = None  # it is judged only from its first sign of life on
        self.started_s = running_s
        self._began_s = time.monotonic()
        self._last_words = ""
        self._output = Lines(process.stdout)
        self._complaints = Lines(process.stderr)

    def write(self, data: bytes) -> None:
        """Write to its stdin; where it has ended, that is noticed elsewhere."""
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.write(data)
                self._process.stdin.flush()

    def output(self) -> list[str]:
        """New lines of its stdout, where it has one of its own."""
        return self._output.take()

    def complaints(self) -> list[str]:
        """New lines of its stderr."""
        self._read_complaints()
        lines = list(self._unread)
        self._unread.clear()
        return lines

    def back_off(self, now_s: float) -> float:
        """Set the moment of the next start; return the wait, which doubles unless the last life was long."""
        if now_s - self._began_s > PROVEN_S:
            self._back_off_s = FIRST_BACK_OFF_S
        wait_s = self._back_off_s
        self.restart_at_s = now_s + wait_s
        self._back_off_s = min(2 * wait_s, LAST_BACK_OFF_S)
        self.history.append((now_s, self.how_it_ended()))
        self.is_ready = False
        return wait_s

    def how_it_ended(self) -> str:
        """For people, its last words included."""
        code = self.code or 0
        how = f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
        words = self.last_words if code > 0 else ""
        return f"{how} ({words})" if words else how

    def ask_to_end(self) -> None:
        """Send SIGTERM if it runs."""
        if self._process is not None:
            self._process.terminate()

    def wait(self, until_s: float) -> None:
        """Wait for its end until a moment of the monotonic clock."""
        if self._process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):  # it is killed at the end
                self._process.wait(timeout=max(0.0, until_s - time.monotonic()))

    def kill(self) -> None:
        """End it at once, whatever it does; it may then be started again."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def release(self) -> None:
        """Kill it if it still runs, and close its pipes."""
        self.kill()
        self._close_pipes()

    def _read_complaints(self) -> None:
        lines = self._complaints.take()
        self._unread.extend(lines)
        self.history.extend((time.monotonic(), line) for line in lines if line)
        self._last_words = next((line for line in reversed(lines) if line), self._last_words)

    def _close_pipes(self) -> None:
        if self._process is None:
            return
        self._read_complaints()
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            if pipe is not None:
                with contextlib.suppress(BrokenPipeError):
                    pipe.close()
        self._output = self._complaints = Lines(None)


class Lines:
    """Lines of a pipe, read without waiting for them.

    Args:
        pipe: Its reading end; None for no lines.
    """

    def __init__(self, pipe: IO[bytes] | None) -> None:
        self._descriptor = None if pipe is None else pipe.fileno()
        self._begun = b""
        if self._descriptor is not None:
            os.set_blocking(self._descriptor, False)

    def take(self) -> list[str]:
        """The lines that are complete, each once; at the end of the pipe also one without its end."""
        if self._descriptor is None:
            return []
        data = self._begun
        for _ in range(_MOST_READS):  # whoever writes without end does not keep us from the others
            try:
                read = os.read(self._descriptor, _READ_BYTES)
            except BlockingIOError:
                break
            if not read:
                self._descriptor = None
                if data and not data.endswith(b"\n"):
                    data += b"\n"
                break
            data += read
        *lines, self._begun = data.split(b"\n")
        return [line.decode(errors="replace").rstrip() for line in lines]


def start_python(arguments: list[str], descriptors: tuple[int, ...] = ()) -> Process:
    """Start an interpreter of its own with these arguments; its stdin and both outputs are pipes.

    Args:
        arguments: Of it.
        descriptors: Open files that it inherits under their numbers.
    """
    return subprocess.Popen(
        [sys.executable, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        pass_fds=descriptors,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    )
