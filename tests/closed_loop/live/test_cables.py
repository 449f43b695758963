"""Cables that are pulled in flight and put in again, and a bus that somebody floods."""

import contextlib
import json
import os
import re
import select
import subprocess
import sys
import threading
import tty

import pytest

from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveStatus
from groundstation.recording.reader import Recording

pytestmark = pytest.mark.slow


class Cable:
    """A serial line from a device's port to one that can be pulled out and put in again under the same name.

    Args:
        device: The device's port.
        name: Where the host finds it.
    """

    def __init__(self, device, name):
        self._device = os.open(device, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._device)
        self._name = name
        self._ending = threading.Event()
        self._lock = threading.Lock()
        self._ours = self._theirs = -1
        self.plug()
        self._pump = threading.Thread(target=self._carry, daemon=True)
        self._pump.start()

    def plug(self):
        """Put it in."""
        with self._lock:
            self._ours, self._theirs = os.openpty()
            tty.setraw(self._theirs)
            os.set_blocking(self._ours, False)
            self._name.symlink_to(os.ttyname(self._theirs))

    def unplug(self):
        """Pull it out: the port is gone, whoever has it open reads its end."""
        with self._lock:
            self._name.unlink()
            os.close(self._theirs)
            os.close(self._ours)
            self._ours = self._theirs = -1

    def close(self):
        self._ending.set()
        self._pump.join()
        if self._ours >= 0:
            self.unplug()
        os.close(self._device)

    def _carry(self):
        while not self._ending.is_set():
            if select.select([self._device], [], [], 0.005)[0]:
                data = os.read(self._device, 4096)
                with self._lock, contextlib.suppress(OSError):
                    if self._ours >= 0:
                        os.write(self._ours, data)
            with self._lock, contextlib.suppress(OSError):
                if self._ours >= 0 and (back := os.read(self._ours, 4096)):
                    os.write(self._device, back)


@pytest.fixture
def laboratory(two_drawn):
    """The emulated laboratory by itself: where its devices are."""
    process = subprocess.Popen(
        [sys.executable, "-m", "firmware_emulator", str(two_drawn)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    yield json.loads(process.stdout.readline())["announce"]
    process.stdin.close()
    process.wait(20)
    process.stdout.close()


@pytest.fixture
def cable(laboratory, tmp_path):
    line = Cable(laboratory["alpha/imu"], tmp_path / "imu_of_alpha")
    yield line
    line.close()


def wired(text, laboratory, imu):
    """The rig as one of real devices: every address is stated, nothing is emulated as far as it knows."""
    bus = laboratory["valve_bus"]
    words = ", ".join(f"{key} = {json.dumps(value)}" for key, value in bus.items())
    text = text.split("[laboratory]")[0].replace('"laboratory:valve_bus"', f"{{ {words} }}")
    text = text.replace('"laboratory:alpha/imu"', json.dumps(str(imu)))
    return re.sub(r'"laboratory:([^"]+)"', lambda match: json.dumps(laboratory[match[1]]), text)


def of(path, kind, vehicle):
    with Recording(path) as recording:
        return [row.payload for row in recording.delivered([kind], [vehicle])]


def test_an_imu_whose_cable_is_pulled_in_flight_lands_its_vehicle_and_flies_again_when_it_is_back(
    launch, two_drawn, laboratory, cable, tmp_path
):
    rig = tmp_path / "wired.toml"
    rig.write_text(wired(two_drawn.read_text(), laboratory, tmp_path / "imu_of_alpha"))
    run = launch(rig)
    run.wait_until_flying()
    run.wait_for("alpha", "flying", "armed")
    run.forget()
    since = len(run.lines)
    cable.unplug()
    for said in (("alpha: FAULT", "silent"), ("alpha/imu:", "next try in")):  # in whatever order
        run._seen = since
        run.wait_for(*said, timeout_s=40.0)
    run.wait_for("beta", "flying", "armed")
    cable.plug()
    run.wait_for("alpha/imu: open")
    run.wait_for("alpha: flying")
    run.wait_for("alpha", "flying", "armed")
    assert not any("starting it again" in line or "Traceback" in line for line in run.lines)
    run.end_in_order()
    assert {"braking", "landing"} <= {row.mode for row in of(run.recording, Supervision, "alpha")}
    assert {row.mode for row in of(run.recording, Supervision, "beta")} & {
        "braking",
        "landing",
        "lost",
    } == set()
    assert of(run.recording, VehicleState, "alpha")[-1].status == "flying"


def test_a_bus_that_somebody_floods_lands_who_hangs_on_it_and_stamps_nothing_older_than_it_is(
    launch, two_drawn
):
    run = launch(two_drawn)
    run.wait_until_flying()
    run.forget()
    assert run.inject("alpha", "flooded_bus", "--rate_hz", "8000", "--for", "4").returncode == 0
    assert "frames a second" in run.wait_for("alpha: FAULT can_flooded")
    run.wait_for("alpha: fault can_flooded is gone")
    run.wait_for("alpha: flying")
    run.wait_for("alpha", "flying", "armed")
    assert not any("starting it again" in line or "Traceback" in line for line in run.lines)
    run.end_in_order()
    with Recording(run.recording) as recording:
        ages_s = [
            1e-9 * (row.envelope.publish_ns - row.payload.stamp_ns)
            for row in recording.delivered([ValveStatus], ["alpha"])
        ]
    assert max(ages_s) < 0.5
    faults = {fault for row in of(run.recording, Faults, "alpha") for fault in row.ids}
    assert "can_silent" not in faults
