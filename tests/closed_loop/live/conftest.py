"""A whole ``groundstation run`` as a child process, watched from outside."""

import contextlib
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

RIGS = Path(__file__).parents[3] / "examples" / "rigs"

TWO_DRAWN = """
name = "two mock-ups, drawn fixes"
valve_bus = "laboratory:valve_bus"
table = { x_min_m = -2.0, x_max_m = 2.0, y_min_m = -1.5, y_max_m = 1.5 }

[mock_ups.standard.imu]
baud = 250000
ftdi_latency_s = 0.001
position_body_m = [0.03151, -0.02122]
gyro_density_rad_s_rthz = 6.7e-5
acc_density_m_s2_rthz = 6.5e-5

[mock_ups.standard.fusion]
rest_s = 1.5

[vehicles.alpha]
mock_up = "standard"
bus_index = 0
imu = "laboratory:alpha/imu"
fixes = "laboratory:alpha/fixes"
reference = "laboratory:alpha/reference"
hold = { x_m = -0.6, y_m = 0.0, heading_deg = 0.0 }

[vehicles.beta]
mock_up = "standard"
bus_index = 1
imu = "laboratory:beta/imu"
fixes = "laboratory:beta/fixes"
reference = "laboratory:beta/reference"
hold = { x_m = 0.6, y_m = 0.0, heading_deg = 90.0 }

[laboratory]
name = "emulator"
table = { bounds_m = [-2.0, 2.0, -1.5, 1.5], tilt_rad = [0.0003, -0.0001] }

[[laboratory.vehicles]]
name = "alpha"
start_m = [-0.6, 0.0]
imu = { averaging = 10, ftdi_latency_ms = 1 }
camera = { source = "fixes", rate_hz = 10.0, delay_s = 0.05 }

[[laboratory.vehicles]]
name = "beta"
start_m = [0.6, 0.0]
start_heading_deg = 90.0
imu = { averaging = 10, ftdi_latency_ms = 1 }
camera = { source = "fixes", rate_hz = 10.0, delay_s = 0.05 }
"""


class Run:
    """One run: what it says, its processes, its end."""

    def __init__(self, rig, folder, name, *words, has_console=False):
        self.recording = folder / f"{name}.mcap"
        self.folder = folder
        self._env = os.environ | {
            "XDG_RUNTIME_DIR": str(folder),
            "XDG_STATE_HOME": str(folder / "state"),
            "OPENBLAS_NUM_THREADS": "1",
        }
        command = [sys.executable, "-m", "groundstation", "run", str(rig), "--headless"]
        if not has_console:  # most tests are not about it, and it costs a second of a core
            command.append("--no-console")
        self.process = subprocess.Popen(
            [*command, "--record", str(self.recording), *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=self._env,
        )
        self.lines = []
        self._news = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self._seen = 0

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line.rstrip())
            self._news.put(None)

    def wait_for(self, *texts, timeout_s=120.0):
        """Wait for a line with all texts, said after the last one waited for; return it."""
        until_s = time.monotonic() + timeout_s
        while True:
            while self._seen < len(self.lines):
                line = self.lines[self._seen]
                self._seen += 1
                if all(text in line for text in texts):
                    return line
            left_s = until_s - time.monotonic()
            assert left_s > 0, f"nobody said {texts}:\n" + "\n".join(self.lines[-40:])
            with contextlib.suppress(queue.Empty):
                self._news.get(timeout=min(left_s, 0.5))

    def wait_until_flying(self):
        """Both vehicles fly."""
        since = self._seen
        for name in ("alpha", "beta"):
            self._seen = since
            self.wait_for(f"{name}: flying")

    def rewind(self):
        """What was said before counts, too."""
        self._seen = 0

    def forget(self):
        """Only what is said from now on counts."""
        self._seen = len(self.lines)

    def pids(self):
        """Process numbers of the launcher's children, by their names."""
        found = {}
        for pid in descendants(self.process.pid):
            words = words_of(pid)
            title, _, name = words[0].partition(" ") if words else ("", "", "")
            if title == "groundstation":
                found[name] = pid
            elif "firmware_emulator" in words:
                found["laboratory"] = pid
        return found

    def every_pid(self):
        """Process numbers of launcher, children and theirs."""
        return (self.process.pid, *descendants(self.process.pid))

    def end_in_order(self):
        """Ask for the end; its code is 0, or 1 where it says that a fault landed a vehicle."""
        code, _ = self.end()
        landed = any("LANDED BY A FAULT" in line for line in self.lines)
        assert code == int(landed), "\n".join(self.lines[-20:])

    def ends_by_itself(self, timeout_s=120.0):
        """Wait for the end; return exit code and all that was said."""
        code = self.process.wait(timeout_s)
        self._reader.join(5)
        return code, "\n".join(self.lines)

    def end(self, number=signal.SIGTERM):
        """Ask for the end; return exit code and the seconds that it took."""
        begin_s = time.monotonic()
        self.process.send_signal(number)
        code = self.process.wait(20)
        took_s = time.monotonic() - begin_s
        self._reader.join(5)
        return code, took_s

    def request(self, *words):
        """``groundstation request`` to this run."""
        return self._call("request", *words)

    def inject(self, *words):
        """``groundstation inject`` into this run."""
        return self._call("inject", *words)

    def _call(self, *words):
        command = [sys.executable, "-m", "groundstation", *words]
        return subprocess.run(command, env=self._env, capture_output=True, text=True, timeout=30, check=False)


def words_of(pid):
    """Command line of a process; empty if it is gone."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_text().split("\0")[:-1]
    except (FileNotFoundError, ProcessLookupError):
        return []


def descendants(pid):
    """Process numbers of all children and their children."""
    found = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            for child in task.read_text().split():
                found += [int(child), *descendants(int(child))]
    return found


def state_of(pid):
    """Letter of the process's state; empty if it is gone (a zombie counts as gone)."""
    try:
        letter = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return ""
    return "" if letter == "Z" else letter


@pytest.fixture
def two_drawn(tmp_path):
    """Rig file: two mock-ups with drawn fixes, which fly after a short rest."""
    path = tmp_path / "rig.toml"
    path.write_text(TWO_DRAWN)
    return path


@pytest.fixture
def launch(tmp_path):
    """Starts runs; whatever is left of them is killed at the end of the test."""
    runs = []

    def start(rig, *words, has_console=False):
        name = f"run_{len(runs) + 1}" if runs else "run"
        runs.append(Run(rig, tmp_path, name, *words, has_console=has_console))
        return runs[-1]

    yield start
    for run in runs:
        for pid in (run.process.pid, *descendants(run.process.pid)):
            if run.process.poll() is None or pid != run.process.pid:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
        run.process.wait()
        run._reader.join(5)
        run.process.stdout.close()


@pytest.fixture
def nothing_left():
    """Asserts that processes, ptys and shared-memory files are as before."""
    before = set(Path("/dev/pts").iterdir()), set(Path("/dev/shm").iterdir())

    def check(pids):
        until_s = time.monotonic() + 4.0
        while time.monotonic() < until_s and any(state_of(pid) for pid in pids):
            time.sleep(0.05)  # the kernel tells nobody but the parent that a process is gone: ask again
        assert not [words_of(pid) for pid in pids if state_of(pid)]
        return before

    return check
