"""A device that is missing, silent or full of noise is named with what happens next; the others fly on."""

import contextlib
import os
import socket
import threading
import tty
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow


def beta_gone(text, key, address):
    """The rig with another address for one device of beta."""
    return text.replace(f'{key} = "laboratory:beta/{key}"', f'{key} = "{address}"')


def fly_with(launch, rig, key, address):
    rig.write_text(beta_gone(rig.read_text(), key, address))
    return launch(rig)


def end_well(run):
    """Alpha flies on to the end, and no process died of it."""
    run.wait_for("alpha", "flying", "armed")
    run.wait_for("alpha", "flying", "armed")
    assert not any("starting it again" in line or "Traceback" in line for line in run.lines)
    assert run.end()[0] == 0


def test_a_serial_port_that_is_not_there(launch, two_drawn):
    run = fly_with(launch, two_drawn, "imu", "/dev/ttyNOWHERE")
    run.wait_for("beta/imu: there is no serial port /dev/ttyNOWHERE; next try in")
    run.rewind()
    run.wait_for("alpha: flying")
    end_well(run)


def test_a_serial_port_that_gives_noise(launch, two_drawn):
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    ending = threading.Event()

    def make_noise():
        while not ending.wait(0.01):
            with contextlib.suppress(BlockingIOError):  # nobody reads just now
                os.write(ours, os.urandom(200))

    noise = threading.Thread(target=make_noise, daemon=True)
    noise.start()
    run = fly_with(launch, two_drawn, "imu", os.ttyname(theirs))
    try:
        run.wait_for("beta/imu: noise and no frame")
        run.rewind()
        run.wait_for("alpha: flying")
        end_well(run)
    finally:
        ending.set()
        noise.join()
        os.close(ours)
        os.close(theirs)


def test_a_camera_that_answers_and_then_says_nothing(launch, tmp_path):
    rigs = Path(__file__).parents[3] / "examples" / "rigs"
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        text = (rigs / "two_mock_ups.toml").read_text()
        text = text.replace("../../calibration", str(rigs.parents[1] / "calibration"))
        rig = tmp_path / "rig.toml"
        rig.write_text(
            text.replace('"laboratory:beta/star_camera"', f'"http://127.0.0.1:{port}/stars"').replace(
                "[vehicles.alpha]", "[mock_ups.standard.fusion]\nrest_s = 2.0\n\n[vehicles.alpha]"
            )
        )
        run = launch(rig)
        run.wait_for("beta/star_camera: star camera", f"127.0.0.1:{port}", "next try in")
        run.rewind()
        run.wait_for("alpha: flying")
        end_well(run)


def test_a_can_adapter_that_is_not_there(launch, two_drawn):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]  # free again in a moment: nobody listens there
    text = two_drawn.read_text()
    bus = f'valve_bus = {{ interface = "slcan", channel = "socket://127.0.0.1:{port}", bitrate = 500000 }}'
    two_drawn.write_text(text.replace('valve_bus = "laboratory:valve_bus"', bus))
    run = launch(two_drawn)
    run.wait_for("valve_bus: the valve bus on slcan", "cannot be opened", "next try in")
    run.rewind()
    run.wait_for("alpha: FAULT can_silent", "no status was ever received")
    run.wait_for("alpha", "lost 0  fix 1")  # samples and ten fixes a second: everything else works
    assert not any("starting it again" in line or "Traceback" in line for line in run.lines)
    assert run.end()[0] == 0
