"""The fork server's own process: loads modules, then forks what the launcher asks for.

Each request is one byte with three descriptors: what to call (pickled), and the stdin and output of the new
process. The answer is its number; it was forked twice, so that by then it is a child of the launcher.
"""

import contextlib
import ctypes
import gc
import importlib
import os
import pickle
import signal
import socket
import struct
import sys
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import NoReturn

LOADED = b"loaded"
"""Sent once, before the first request is taken."""
PID = struct.Struct("<i")

_ARENA_MAX = -8  # <malloc.h>
_ARGUMENTS = 45  # field of /proc/self/stat behind the name: where the command line begins in memory
_KEPT_OPEN = 3  # stdin, stdout, stderr


def share_one_arena() -> None:
    """Let all threads of a process allocate from one place: one for each costs a megabyte a process."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # glibc has it
    if mallopt is not None:
        mallopt(_ARENA_MAX, 1)


def give_memory_back() -> None:
    """Give the system what is free: reading files and making nodes took more than keeping them does.

    Of a process with a star tracker that is five megabytes, most of them of the table of its camera's rays.
    """
    malloc_trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc has it
    if malloc_trim is not None:
        malloc_trim(0)


def serve(requests: socket.socket, modules: Iterable[str]) -> None:
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
    give_memory_back()
    requests.send(LOADED)
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
        answer = os.read(answer_ours, PID.size)
        os.close(answer_ours)
        requests.send(answer or b"-")


def _fork_again(descriptors: list[int], answer: int) -> NoReturn:
    """Fork the process that was asked for, answer its number and end, so that it becomes an orphan."""
    code = 1
    try:
        pid = os.fork()
        if pid:
            os.write(answer, PID.pack(pid))
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
    sys.stdout = sys.stderr = open(2, "w", 1, "utf-8", "surrogateescape", closefd=False)  # noqa: SIM115 open to the end
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
    serve(socket.socket(fileno=int(sys.argv[1])), sys.argv[2:])


if __name__ == "__main__":
    main()
