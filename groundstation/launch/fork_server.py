"""Processes forked from one that has loaded everything, so that they start at once and share its pages.

The server has no thread and opens nothing. It is forked from the launcher while that has no threads either,
and started as an interpreter of its own where it has (a server that was killed is replaced in this way).
What it forks becomes a child of the launcher: the server forks twice, and the launcher is the subreaper of
what descends from it. So the launcher learns at once how a process ended, and processes outlive the server.

The standard library's fork server (``multiprocessing``) does not do: when its server dies, its processes
count as ended with code 255 though they live; and it brings another process, the resource tracker.
"""

import contextlib
import ctypes
import gc
import os
import pickle
import select
import signal
import socket
import subprocess
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from groundstation.declarations.errors import GroundStationError
from groundstation.launch import forking
from groundstation.launch.forking import LOADED, PID, serve

ANSWER_WITHIN_S = 10.0
"""A server that still loads what it needs answers late; one that takes longer is given up."""
FORK_WITHIN_S = 2.0
"""One that has loaded forks in milliseconds; whoever supervises is not kept longer by one that hangs."""

_SET_CHILD_SUBREAPER = 36  # <sys/prctl.h>


class ForkedProcess:
    """A running process, with the methods of ``subprocess.Popen`` that a supervisor needs.

    Attributes:
        pid: Its number.
        stdin: What it reads; its end tells it that nobody is there any more.
        stdout: None: it has none of its own, what it prints goes to ``stderr``.
        stderr: What it writes.
        returncode: None while it runs; its exit code, or minus the signal that ended it.
    """

    stdout: None = None

    def __init__(self, pid: int, stdin: BinaryIO, stderr: BinaryIO) -> None:
        self.pid = pid
        self.stdin = stdin
        self.stderr = stderr
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """``returncode``, after a look whether it has ended."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end.

        Raises:
            subprocess.TimeoutExpired: It still runs.
        """
        if self.poll() is None:
            descriptor = os.pidfd_open(self.pid)
            try:
                select.select([descriptor], [], [], timeout)
            finally:
                os.close(descriptor)
            if self.poll() is None:
                raise subprocess.TimeoutExpired("forked process", timeout or 0.0)
        assert self.returncode is not None
        return self.returncode

    def terminate(self) -> None:
        """Send SIGTERM."""
        self._send(signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL."""
        self._send(signal.SIGKILL)

    def _send(self, number: signal.Signals) -> None:
        if self.poll() is None:  # it is our child: its number is not given to another before we looked
            os.kill(self.pid, number)


class ForkServer:
    """The launcher's side of the server.

    Args:
        modules: What the server loads before it forks.

    Attributes:
        pid: Of the server; None before ``start``.
    """

    def __init__(self, modules: tuple[str, ...]) -> None:
        self._modules = modules
        self._socket: socket.socket | None = None
        self._popen: subprocess.Popen[bytes] | None = None
        self._is_loaded = False
        self.pid: int | None = None

    @property
    def is_loaded(self) -> bool:
        """Whether it has loaded its modules, and forks at once."""
        if not self._is_loaded and self._socket is not None:
            self._is_loaded = bool(select.select([self._socket], [], [], 0.0)[0])
            if self._is_loaded:
                self._socket.recv(len(LOADED))
        return self._is_loaded

    def start(self) -> None:
        """Start the server, or another one for a server that has ended.

        Raises:
            GroundStationError: The system is not Linux.
        """
        _adopt_orphans()
        self.close()
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket, self._is_loaded = ours, False
        with theirs:
            if _has_threads():  # they would be missing in the copy, their locks perhaps held
                self._start_interpreter(theirs.fileno())
            else:
                self._fork_ourselves(theirs)
        ours.settimeout(ANSWER_WITHIN_S)

    def keep(self) -> bool:
        """Replace the server if it has ended; return whether it had."""
        if not self._has_ended():
            return False
        self.start()
        return True

    def fork(self, name: str, target: Callable[..., None], *arguments: object) -> ForkedProcess:
        """Start a process that calls ``target`` and ends.

        Args:
            name: Shown by ``ps``.
            target: A function that can be pickled: of a module.
            arguments: Of the function; pickled, too.

        Raises:
            GroundStationError: Even a new server does not answer.
        """
        request = os.memfd_create("request")  # of any size, and nobody waits for its reader
        with open(request, "wb", closefd=False) as file:
            pickle.dump((name, target, arguments), file)
        stdin_theirs, stdin_ours = os.pipe()
        stderr_ours, stderr_theirs = os.pipe()
        try:
            pid = self._ask([request, stdin_theirs, stderr_theirs])
        except BaseException:
            os.close(stdin_ours)
            os.close(stderr_ours)
            raise
        finally:
            for descriptor in (request, stdin_theirs, stderr_theirs):
                os.close(descriptor)
        return ForkedProcess(pid, os.fdopen(stdin_ours, "wb"), os.fdopen(stderr_ours, "rb"))

    def close(self) -> None:
        """End the server; what it forked lives on."""
        if self._socket is not None:
            self._socket.close()  # which ends a server that waits for requests
            self._socket = None
        if self._popen is not None:
            self._popen.kill()
            self._popen.wait()
            self._popen = None
        elif self.pid is not None:
            with contextlib.suppress(
                ChildProcessError, ProcessLookupError
            ):  # it has ended and was waited for
                os.kill(self.pid, signal.SIGKILL)
                os.waitpid(self.pid, 0)
        self.pid = None

    def _ask(self, descriptors: list[int]) -> int:
        try:
            return self._ask_once(descriptors)
        except OSError:  # it has just died
            self.start()
        try:
            return self._ask_once(descriptors)
        except OSError as error:
            raise GroundStationError(f"the fork server does not answer: {error}") from error

    def _ask_once(self, descriptors: list[int]) -> int:
        if self._socket is None:
            raise ConnectionError("it was not started")
        if not self._is_loaded:
            self._is_loaded = self._socket.recv(len(LOADED)) == LOADED
        self._socket.settimeout(FORK_WITHIN_S)
        socket.send_fds(self._socket, [b"f"], descriptors)
        answer = self._socket.recv(PID.size)
        if len(answer) != PID.size:
            raise ConnectionError("it has ended")
        number: int = PID.unpack(answer)[0]
        return number

    def _has_ended(self) -> bool:
        if self._popen is not None:
            return self._popen.poll() is not None
        if self.pid is None:
            return True
        if os.waitpid(self.pid, os.WNOHANG)[0] == 0:
            return False
        self.pid = None
        return True

    def _start_interpreter(self, descriptor: int) -> None:
        self._popen = subprocess.Popen(
            [sys.executable, "-m", forking.__name__, str(descriptor), *self._modules],
            stdin=subprocess.DEVNULL,
            pass_fds=[descriptor],
            start_new_session=True,
            env=os.environ
            | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
            | {"PYTHONPATH": os.pathsep.join(path or str(Path.cwd()) for path in sys.path)},
        )
        self.pid = self._popen.pid

    def _fork_ourselves(self, theirs: socket.socket) -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        gc.collect()
        gc.freeze()  # a collection would write to every object, and what is written to is no longer shared
        self.pid = os.fork()
        if self.pid == 0:
            code = 1
            try:
                os.setsid()
                serve(theirs, self._modules)
                code = 0
            except BaseException:  # whatever it is, it must not return into the launcher's code
                traceback.print_exc()
            finally:
                os._exit(code)


def _adopt_orphans() -> None:
    """Become the parent of processes whose parent ends, down from here."""
    prctl = getattr(ctypes.CDLL(None, use_errno=True), "prctl", None)
    if prctl is None or prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        raise GroundStationError("processes can be started on Linux only")


def _has_threads() -> bool:
    """Whether this process has threads, be it of Python or of a library."""
    return len(list(Path("/proc/self/task").iterdir())) > 1
