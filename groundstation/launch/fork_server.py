"""Processes forked from one that has loaded everything, so that they start at once and share its pages.

The server has no thread and opens nothing. It is forked from the launcher while that has no threads either,
and started as an interpreter of its own where it has (a server that was killed is replaced in this way).
What it forks becomes a child of the launcher: the server forks twice, and the launcher is the subreaper of
what descends from it. So the launcher learns at once how a process ended, and processes outlive the server.

The standard library's fork server (``multiprocessing``) was tried: when its server dies, its processes count
as ended with code 255, and a second helper process, the resource tracker, costs 8 MB.
"""

import contextlib
import ctypes
import gc
import importlib
import os
import pickle
import select
import signal
import socket
import struct
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import BinaryIO, NoReturn

from groundstation.declarations.errors import GroundStationError

ANSWER_WITHIN_S = 10.0
"""A server that still loads what it needs answers late; one that takes longer is given up."""

_SET_CHILD_SUBREAPER = 36  # <sys/prctl.h>
_ARENA_MAX = -8  # <malloc.h>
_LOADED = b"loaded"
_PID = struct.Struct("<i")
_ARGUMENTS = 45  # field of /proc/self/stat behind the name: where the command line begins in memory
_KEPT_OPEN = 3  # stdin, stdout, stderr


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
                self._socket.recv(len(_LOADED))
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
            self._is_loaded = self._socket.recv(len(_LOADED)) == _LOADED
        socket.send_fds(self._socket, [b"f"], descriptors)
        answer = self._socket.recv(_PID.size)
        if len(answer) != _PID.size:
            raise ConnectionError("it has ended")
        number: int = _PID.unpack(answer)[0]
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
            [sys.executable, "-m", __spec__.name, str(descriptor), *self._modules],
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
                _serve(theirs, self._modules)
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


def share_one_arena() -> None:
    """Let all threads of a process allocate from one place: one for each costs a megabyte a process."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # glibc has it
    if mallopt is not None:
        mallopt(_ARENA_MAX, 1)


def _has_threads() -> bool:
    """Whether this process has threads, be it of Python or of a library."""
    return len(list(Path("/proc/self/task").iterdir())) > 1


def _serve(requests: socket.socket, modules: Iterable[str]) -> None:
    """Load modules, then fork what is asked for, until the other end is closed."""
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTSTP):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _close_but(requests.fileno())
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    os.close(nothing)
    _set_name("fork_server")
    share_one_arena()
    for module in modules:
        importlib.import_module(module)
    gc.collect()
    gc.freeze()
    requests.send(_LOADED)
    while True:
        asked, descriptors, _, _ = socket.recv_fds(requests, 1, 3)
        if not asked:
            return
        answer_ours, answer_theirs = os.pipe()
        between = os.fork()
        if between == 0:
            _fork_again(descriptors, answer_theirs)
        for descriptor in (*descriptors, answer_theirs):
            os.close(descriptor)
        os.waitpid(between, 0)  # from now on the new process is the launcher's
        answer = os.read(answer_ours, _PID.size)
        os.close(answer_ours)
        requests.send(answer or b"-")


def _fork_again(descriptors: list[int], answer: int) -> NoReturn:
    """Fork the process that was asked for, answer its number and end, so that it becomes an orphan."""
    code = 1
    try:
        pid = os.fork()
        if pid:
            os.write(answer, _PID.pack(pid))
        else:
            _become(*descriptors)
        code = 0
    except SystemExit as done:
        code = done.code if isinstance(done.code, int) else 1
    except BaseException:  # whatever it is, it must not return into the server's loop
        traceback.print_exc()
    finally:
        os._exit(code)


def _become(request: int, stdin: int, stderr: int) -> None:
    """Be the process that was asked for."""
    os.setsid()  # Ctrl-C reaches the launcher alone
    os.dup2(stdin, 0)
    os.dup2(stderr, 1)
    os.dup2(stderr, 2)
    pickled = Path(f"/proc/self/fd/{request}").read_bytes()  # by this name it is read from its beginning
    _close_but(None)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115 the old one may have read ahead
    sys.stdout = sys.stderr = open(2, "w", buffering=1, closefd=False)  # noqa: SIM115 open to the end
    for number in (signal.SIGHUP, signal.SIGTSTP):
        signal.signal(number, signal.SIG_DFL)
    name, target, arguments = pickle.loads(pickled)
    _set_name(name)
    target(*arguments)
    sys.stderr.flush()


def _close_but(kept: int | None) -> None:
    """Close what was open before the fork: another process's stdin must end with the launcher alone."""
    for entry in list(os.scandir("/proc/self/fd")):
        descriptor = int(entry.name)
        if descriptor >= _KEPT_OPEN and descriptor != kept:
            with contextlib.suppress(OSError):  # that of the listing itself
                os.close(descriptor)


def _set_name(name: str) -> None:
    """The name that ``ps`` shows: 15 characters of it as the command, the whole as the command line."""
    Path("/proc/self/comm").write_text(name)
    begin, end = map(int, Path("/proc/self/stat").read_text().rpartition(")")[2].split()[_ARGUMENTS:][:2])
    room = end - begin
    if room > 1:
        ctypes.memmove(begin, f"groundstation {name}".encode()[: room - 1].ljust(room, b"\0"), room)


def main() -> None:
    """Serve as an interpreter of its own: number of the socket, then the modules to load."""
    _serve(socket.socket(fileno=int(sys.argv[1])), sys.argv[2:])


if __name__ == "__main__":
    main()
