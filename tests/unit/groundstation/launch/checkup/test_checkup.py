"""The checkup of machines that consist of files: fit ones, and what each thing that is wrong is called."""

import os
import stat

import cv2
import numpy as np
import pytest

from groundstation.launch.checkup import cameras, can_buses, lines, machine
from groundstation.launch.checkup.checkup import examine
from groundstation.launch.checkup.finding import Machine, Verdict
from groundstation.launch.checkup.machine import KernelClock
from groundstation.parts.stars.port import StarCameraPort
from groundstation.rig.read import load_rig

OK, WARN, BAD = Verdict.OK, Verdict.WARN, Verdict.BAD
SOMEBODY = 4711
GOVERNOR = "sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor"
CLOCK = "sys/devices/system/clocksource/clocksource0/current_clocksource"
TIMER = "sys/bus/usb-serial/devices/ttyUSB0/latency_timer"
KEPT = KernelClock(True, 0.002)


@pytest.fixture
def about(tmp_path):
    return Machine(tmp_path, SOMEBODY, frozenset({SOMEBODY}))


@pytest.fixture
def put(tmp_path):
    def write(path, text="", mode=0o666):
        file = tmp_path / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        file.chmod(mode)
        return file

    return write


def one(findings):
    (found,) = findings
    return found


@pytest.mark.parametrize(
    ("governors", "verdict", "words"),
    [
        ((), OK, "virtual machine"),
        (("performance", "performance"), OK, "all 2 processors"),
        (("performance", "powersave"), WARN, "powersave of 1"),
        (("schedutil\n", "schedutil\n"), WARN, "schedutil of 2"),
    ],
)
def test_governors(about, put, governors, verdict, words):
    for number, governor in enumerate(governors):
        put(GOVERNOR.format(number), governor)
    found = one(machine.processors(about))
    assert found.verdict is verdict
    assert words in found.what
    assert bool(found.advice) == (verdict is not OK)


@pytest.mark.parametrize(
    ("source", "verdict"), [("tsc\n", OK), ("hpet\n", WARN), (None, OK), ("acpi_pm", WARN)]
)
def test_clock_sources(about, put, source, verdict):
    if source is not None:
        put(CLOCK, source)
    first, _ = machine.clocks(about, lambda: KEPT)
    assert first.verdict is verdict


@pytest.mark.parametrize(
    ("clock", "verdict"),
    [(KEPT, OK), (KernelClock(False, 16.0), WARN), (KernelClock(True, 0.5), WARN), (None, WARN)],
)
def test_what_keeps_utc(about, clock, verdict):
    _, second = machine.clocks(about, lambda: clock)
    assert second.verdict is verdict


def test_the_kernel_of_this_machine_answers():
    clock = machine.kernel_clock()
    assert clock is None or clock.max_error_s >= 0.0


def test_a_disk_with_room_and_a_folder_nobody_may_write_to(tmp_path, monkeypatch):
    assert one(machine.disk(tmp_path / "not" / "made" / "yet")).subject == "disk"
    (tmp_path / "file").write_text("")
    assert one(machine.disk(tmp_path / "file" / "below")).verdict is BAD
    real = os.statvfs(tmp_path)
    for free, verdict in ((5e8, BAD), (5e9, WARN), (5e11, OK)):
        fields = list(real)
        fields[1], fields[4] = 4096, int(free / 4096)  # f_frsize, f_bavail
        monkeypatch.setattr(os, "statvfs", lambda _path, fields=fields: os.statvfs_result(fields))
        assert one(machine.disk(tmp_path)).verdict is verdict


@pytest.mark.parametrize(("kilobytes", "verdict"), [(100_000, BAD), (500_000, WARN), (8_000_000, OK)])
def test_memory(about, put, kilobytes, verdict):
    put("proc/meminfo", f"MemTotal:  9000000 kB\nMemAvailable: {kilobytes} kB\n")
    assert one(machine.memory(about)).verdict is verdict


def test_memory_that_is_not_told_is_no_finding(about, put):
    assert not list(machine.memory(about))
    put("proc/meminfo", "MemTotal\nMemAvailable: much\n")
    assert not list(machine.memory(about))


def test_a_laptop_is_to_be_plugged_in(about, put):
    assert not list(machine.power(about))
    put("sys/class/power_supply/BAT0/type", "Battery\n")
    put("sys/class/power_supply/AC/type", "Mains\n")
    put("sys/class/power_supply/AC/online", "0\n")
    assert one(machine.power(about)).verdict is WARN
    put("sys/class/power_supply/AC/online", "1\n")
    assert one(machine.power(about)).verdict is OK


def test_the_right_to_go_first(about):
    assert one(machine.urgency(about, lambda _which: (0, 0))).verdict is WARN
    assert one(machine.urgency(about, lambda _which: (5, 5))).verdict is OK


@pytest.mark.parametrize(("timer", "verdict"), [("1\n", OK), ("16\n", WARN), (None, OK)])
def test_latency_timers_are_found_through_links(about, put, tmp_path, timer, verdict):
    put("dev/ttyUSB0")
    by_id = tmp_path / "dev/serial/by-id"
    by_id.mkdir(parents=True)
    (by_id / "usb-FTDI").symlink_to("../../ttyUSB0")
    if timer is not None:
        put(TIMER, timer)
    for address in ("/dev/ttyUSB0", "/dev/serial/by-id/usb-FTDI"):
        found = one(lines.serial_line(about, "alpha/imu", address))
        assert found.verdict is verdict
    if verdict is WARN:
        assert "16 ms" in found.what
        assert "/sys/bus/usb-serial/devices/ttyUSB0/latency_timer" in found.advice


def test_a_line_that_is_not_there_or_may_not_be_used(about, put):
    assert one(lines.serial_line(about, "alpha/imu", "/dev/ttyUSB7")).verdict is BAD
    file = put("dev/ttyUSB0", mode=0o660)
    found = one(lines.serial_line(about, "alpha/imu", "/dev/ttyUSB0"))
    assert found.verdict is BAD
    assert "usermod -aG" in found.advice
    owner = file.stat()
    for user in (
        Machine(about.root, 0, frozenset()),
        Machine(about.root, owner.st_uid, frozenset()),
        Machine(about.root, SOMEBODY, frozenset({owner.st_gid})),
    ):
        assert one(lines.serial_line(user, "alpha/imu", "/dev/ttyUSB0")).verdict is OK


@pytest.mark.parametrize("mode", [0o400, 0o200, 0o040, 0o004, 0o666, 0o000])
def test_permissions_are_those_of_owner_group_and_others(about, put, mode):
    file = put("dev/ttyACM0", mode=mode)
    found = file.stat()
    assert stat.S_IMODE(found.st_mode) == mode
    assert about.may_use(file) == (mode & 0o6 == 0o6)


def can(put, name="can0", flags="0x1", kind="280", rx="0", tx="0"):
    for path, text in {
        "type": kind, "flags": flags, "statistics/rx_errors": rx, "statistics/tx_errors": tx,
    }.items():  # fmt: skip
        put(f"sys/class/net/{name}/{path}", f"{text}\n")


@pytest.mark.parametrize(
    ("made", "verdict", "words"),
    [
        ({}, OK, "up, without errors"),
        ({"flags": "0x40080"}, BAD, "is down"),
        ({"rx": "12"}, WARN, "12 errors received"),
        ({"kind": "1"}, BAD, "is no CAN interface"),
        ({"name": "can1"}, BAD, "there is no interface can0 (there are can1)"),
    ],
)
def test_can_interfaces(about, put, made, verdict, words):
    can(put, **made)
    found = one(can_buses.can_bus(about, "valve_bus", "can0"))
    assert found.verdict is verdict
    assert words in found.what


@pytest.fixture
def folder(tmp_path):
    """A camera of real files: ten pictures of 64 x 48 px."""
    made = tmp_path / "pictures"
    made.mkdir()
    for number in range(10):
        cv2.imwrite(str(made / f"{number:03d}.png"), np.full((48, 64), number, np.uint8))
    return made


def camera_of(address):
    return StarCameraPort("alpha/star_camera", "alpha", str(address), 2.0)


def test_a_camera_is_measured_by_its_own_driver(folder):
    found = cameras.measure(camera_of(folder), 0.5)
    assert (found.width, found.height) == (64, 48)
    assert found.rate_hz > 0.0


@pytest.mark.parametrize(("wanted", "verdict"), [((64, 48), OK), ((640, 480), BAD), (None, OK)])
def test_pictures_must_have_the_size_of_the_calibration(about, folder, wanted, verdict):
    measured = cameras.Measured(64, 48, 15.0)
    found = one(cameras.camera(about, camera_of(folder), wanted, lambda _port: measured))
    assert found.verdict is verdict
    assert "64 x 48 px, 15.0 pictures a second" in found.what


def test_a_camera_that_is_slow_silent_or_gone(about, folder, put):
    slow = one(cameras.camera(about, camera_of(folder), None, lambda _port: cameras.Measured(64, 48, 2.0)))
    assert slow.verdict is WARN
    silent = one(cameras.camera(about, camera_of(folder), None, lambda _port: None))
    assert silent.verdict is BAD
    gone = one(cameras.camera(about, camera_of(folder / "nowhere"), None))
    assert (gone.verdict, "nowhere" in gone.what) == (BAD, True)
    unplugged = one(cameras.camera(about, camera_of("3"), None))
    assert "/dev/video3 is not there" in unplugged.what
    put("dev/video0", mode=0o660)
    assert one(cameras.plugged_in(about)).verdict is BAD


def test_without_a_rig_everything_that_is_plugged_in_is_looked_at(about, put):
    put("dev/ttyUSB0")
    put(TIMER, "16")
    put("dev/video0")
    put("sys/class/video4linux/video0/name", "A camera\n")
    can(put)
    found = {finding.subject: finding for finding in examine(about, None, lambda _subject: None)}
    assert found["serial line"].verdict is WARN
    assert "A camera" in found["camera"].what
    assert found["CAN"].verdict is OK


RIG = """
name = "on the desk"
valve_bus = { interface = "socketcan", channel = "can0", bitrate = 250000 }
table = { x_min_m = -2.0, x_max_m = 2.0, y_min_m = -1.5, y_max_m = 1.5 }
[mock_ups.standard.imu]
gyro_density_rad_s_rthz = 6.7e-5
acc_density_m_s2_rthz = 6.5e-5
[vehicles.alpha]
mock_up = "standard"
bus_index = 0
imu = "/dev/ttyUSB0"
fixes = "socket://mocap.lab:7000"
hold = { x_m = -0.6, y_m = 0.0, heading_deg = 0.0 }
"""


def test_the_devices_of_a_rig_are_looked_at_by_their_channels(about, put, tmp_path):
    file = tmp_path / "rig.toml"
    file.write_text(RIG)
    can(put, flags="0x0")
    rig = load_rig(file)
    found = {finding.subject: finding for finding in examine(about, rig, lambda _subject: None)}
    assert found["alpha/imu"].verdict is BAD
    assert found["valve_bus"].advice == "sudo ip link set can0 up type can bitrate 250000"
    assert "was not looked at" in found["alpha/fixes"].what
    assert not any("memory" in subject and "station" in subject for subject in found)
