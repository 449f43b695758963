"""Processes forked from the server: how they start, what they get, how they end, who is lost with whom."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from groundstation.launch.fork_server import ForkServer

SAY_AND_WAIT = "import sys; print('here', flush=True); sys.stdin.buffer.read(); print('end of stdin')"


@pytest.fixture(params=["of this process", "of an interpreter of its own"])
def server(request):
    ending = threading.Event()
    thread = threading.Thread(target=ending.wait)
    if request.param == "of an interpreter of its own":  # which it is wherever there are threads
        thread.start()
    made = ForkServer(())
    made.start()
    yield made
    made.close()
    ending.set()
    if thread.ident is not None:
        thread.join()


@pytest.fixture
def fork(server):
    """Forks processes that run a text; what still runs is killed at the end."""
    processes = []

    def start(text, name="test"):
        processes.append(server.fork(name, exec, text, {}))
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.wait(5)
        process.stdin.close()
        process.stderr.close()


def status_of(pid, field):
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(f"{field}:"):
            return line.split()[1]
    raise AssertionError(field)


def test_a_process_gets_its_arguments_whole_and_its_output_arrives(server):
    process = server.fork("test", exec, "print(len(data), data[-3:])", {"data": b"x" * 3_000_000 + b"end"})
    assert process.stderr.read() == b"3000003 b'end'\n"
    assert process.wait(5) == 0
    process.stdin.close()
    process.stderr.close()


def test_a_process_is_a_child_of_the_launcher_in_a_session_of_its_own_and_has_its_name(fork):
    process = fork(SAY_AND_WAIT, name="a_vehicle_with_a_long_name_flight")
    assert process.stderr.readline() == b"here\n"
    assert status_of(process.pid, "PPid") == str(os.getpid())
    assert os.getsid(process.pid) == process.pid
    assert Path(f"/proc/{process.pid}/comm").read_text() == "a_vehicle_with_\n"
    line = Path(f"/proc/{process.pid}/cmdline").read_bytes().rstrip(b"\0").decode()
    assert line == "groundstation a_vehicle_with_a_long_name_flight"


def test_nothing_is_open_in_a_process_but_its_pipes(fork):
    reading, writing = os.pipe()
    os.set_inheritable(writing, True)
    process = fork("import os; print(sorted(map(int, os.listdir('/proc/self/fd')))[:-1])")
    assert process.stderr.readline() == b"[0, 1, 2]\n"  # the last is that of the listing
    os.close(reading)
    os.close(writing)


def test_the_end_of_stdin_reaches_a_process_though_others_were_forked_after_it(fork):
    first = fork(SAY_AND_WAIT)
    second = fork(SAY_AND_WAIT)
    first.stdin.close()
    assert first.stderr.read() == b"here\nend of stdin\n"
    assert first.wait(5) == 0
    assert second.poll() is None


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("raise SystemExit(7)", 7),
        ("import os; os._exit(2)", 2),
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", -signal.SIGSEGV),
    ],
)
def test_the_exit_code_or_signal_is_known(fork, text, code):
    assert fork(text).wait(5) == code


def test_an_exception_leaves_its_traceback_on_stderr(fork):
    process = fork("raise ValueError('what is wrong')")
    assert process.stderr.read().endswith(b"ValueError: what is wrong\n")
    assert process.wait(5) == 1


def test_ctrl_c_is_ignored_and_a_request_to_end_is_not(fork):
    process = fork(SAY_AND_WAIT)
    process.stderr.readline()
    os.kill(process.pid, signal.SIGINT)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.1)
    process.terminate()
    assert process.wait(5) == -signal.SIGTERM


def test_a_killed_server_is_replaced_while_its_processes_live_on(server, fork):
    before = fork(SAY_AND_WAIT)
    before.stderr.readline()
    assert not server.keep()
    os.kill(server.pid, signal.SIGKILL)
    after = fork(SAY_AND_WAIT)  # without anybody's having looked first
    after.stderr.readline()
    assert before.poll() is None
    before.stdin.close()
    assert before.wait(5) == 0
    after.kill()
    assert after.wait(5) == -signal.SIGKILL


def test_a_look_replaces_a_server_that_has_ended(server):
    old = server.pid
    os.kill(old, signal.SIGKILL)
    until_s = time.monotonic() + 5.0
    while not server.keep():
        assert time.monotonic() < until_s
    assert server.pid != old
    assert not server.keep()


def test_a_closed_server_ends_and_its_processes_do_not(fork, server):
    process = fork(SAY_AND_WAIT)
    process.stderr.readline()
    pid = server.pid
    server.close()
    assert not Path(f"/proc/{pid}").exists()
    assert process.poll() is None


FROM_A_LAUNCHER_WITHOUT_THREADS = """
import os, sys, time
from pathlib import Path
from groundstation.launch.fork_server import ForkServer

server = ForkServer(("colorsys",))
server.start()
program = "import sys; print('colorsys' in sys.modules, flush=True); sys.stdin.read(); print('alone')"
process = server.fork("test", exec, program, {})
loaded = process.stderr.readline().decode().strip()
assert Path(f"/proc/{server.pid}/cmdline").read_text().startswith("groundstation fork_server")
print(loaded, len(os.listdir("/proc/self/task")), flush=True)
print(server.pid, process.pid, flush=True)
sys.stdin.read()
"""


def test_a_launcher_without_threads_forks_itself_and_takes_all_with_it_when_it_is_killed():
    launcher = subprocess.Popen(
        [sys.executable, "-c", FROM_A_LAUNCHER_WITHOUT_THREADS],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert launcher.stdout.readline() == b"True 1\n"
    pids = [int(word) for word in launcher.stdout.readline().split()]
    assert all(Path(f"/proc/{pid}").exists() for pid in pids)
    launcher.kill()
    launcher.wait()
    until_s = time.monotonic() + 5.0
    while any(Path(f"/proc/{pid}").exists() and status_of(pid, "State") != "Z" for pid in pids):
        assert time.monotonic() < until_s  # the kernel tells nobody but the parent that a process is gone
    assert launcher.stdout.read() == b""  # nobody else holds it open
    launcher.stdin.close()
    launcher.stdout.close()


def test_a_server_that_hangs_is_replaced_before_a_person_grows_impatient(server, fork):
    first = fork(SAY_AND_WAIT)
    assert first.stderr.readline() == b"here\n"
    hanging = server.pid
    os.kill(hanging, signal.SIGSTOP)
    begin_s = time.monotonic()
    assert fork(SAY_AND_WAIT).stderr.readline() == b"here\n"
    assert time.monotonic() - begin_s < 8.0  # two seconds, and the start of an interpreter
    assert server.pid != hanging
    assert first.poll() is None
