"""A flight with its console, and Chromium without a screen; without Chromium the tests are skipped."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "two_mock_ups_drawn.toml"
SIZES = {"phone": (390, 844), "tablet": (1024, 768), "laptop": (1366, 768)}
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def chromium():
    """A browser; the tests say so where there is none."""
    path = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip("no Chromium on this machine (Debian: apt install chromium)")
    api = pytest.importorskip("playwright.sync_api", reason="the extra `tests` is not installed")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


class Served:
    """A process that prints the address of a console."""

    def __init__(self, folder, *words):
        env = os.environ | {
            "XDG_RUNTIME_DIR": str(folder),
            "XDG_STATE_HOME": str(folder / "state"),
            "OPENBLAS_NUM_THREADS": "1",
        }
        self.process = subprocess.Popen(
            [sys.executable, "-m", "groundstation", *map(str, words)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=env,
        )
        self.lines = []
        self._printed = threading.Event()
        self.address = ""
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        assert self._printed.wait(60), "\n".join(self.lines)

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line.rstrip())
            found = re.search(r"console: (http://\S+)", line)
            if found:
                self.address = found[1]
                self._printed.set()

    def child(self, name):
        """Process number of a child of the launcher."""
        for task in Path(f"/proc/{self.process.pid}/task").glob("*/children"):
            for pid in task.read_text().split():
                words = Path(f"/proc/{pid}/cmdline").read_text().split("\0")
                if words[0] == f"groundstation {name}":
                    return int(pid)
        raise AssertionError(f"there is no process {name}")

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(20)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self._reader.join(5)
        self.process.stdout.close()


@pytest.fixture(scope="module")
def flight(tmp_path_factory, chromium):
    """Two mock-ups that fly; one flight for all tests of a module."""
    folder = tmp_path_factory.mktemp("flight")
    run = Served(folder, "run", RIG, "--headless", "--record", folder / "run.mcap")
    run.folder = folder
    yield run
    run.end()


@pytest.fixture
def launch(tmp_path, chromium):
    """Starts what prints the address of a console; ended after the test."""
    started = []

    def start(*words):
        started.append(Served(tmp_path, *words))
        return started[-1]

    yield start
    for run in started:
        run.end()


@pytest.fixture
def opened(chromium):
    """Opens pages of a size and colour scheme; whatever the page complains of fails the test."""
    contexts, complaints = [], []

    def open_page(address, size="laptop", scheme="light"):
        width, height = SIZES[size]
        context = chromium.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme, has_touch=size != "laptop"
        )
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(address)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert not complaints


def state_of(page):
    """What the console's API says."""
    return json.loads(page.evaluate("fetch('/api/state').then((answer) => answer.text())"))


@pytest.fixture
def api():
    return state_of
