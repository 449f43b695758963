"""Every command of the page on control from outside, as it stands there, on a port of its own."""

import os
import re
import shlex
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "how_to" / "control_from_outside.md"
PORT = "7447"

pytestmark = pytest.mark.slow


@pytest.fixture
def commands():
    """The commands of the page, in words, with a free port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = str(probe.getsockname()[1])
    blocks = re.findall(r"```sh\n(.*?)```", PAGE.read_text(), flags=re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines()]
    return [shlex.split(line.replace(PORT, port)) for line in lines]


def test_the_commands_do_what_the_page_says(commands, launch):
    run_words, circle_words, resume_words = commands
    assert run_words[:2] == ["groundstation", "run"]
    run = launch(ROOT / run_words[2], *run_words[3:])
    assert run_words[-1] in run.wait_for("outside: open at")
    run.wait_for("alpha: flying")
    assert circle_words[0] == "python"
    client = subprocess.Popen(
        [sys.executable, *circle_words[1:]],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        assert client.stdout.readline() == "anna flies alpha\n"
        run.forget()
        for _ in range(2):
            run.wait_for("alpha", "armed")
        os.kill(client.pid, signal.SIGKILL)
        run.rewind()
        run.wait_for("alpha: FAULT outside_silent")
    finally:
        client.kill()
        client.communicate()
    assert resume_words[:2] == ["groundstation", "request"]
    done = run.request(*resume_words[2:])
    assert done.returncode == 0, done.stdout
    run.wait_for("alpha: fault outside_silent is gone")
    run.end_in_order()
