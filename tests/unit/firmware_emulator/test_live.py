import os
import select
import selectors
import socket
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest

from drivers.errors import NotFound
from drivers.imu_block.port import SerialPort
from drivers.imu_block.protocol import FrameParser, Identity, ImuFrame, encode_identify
from drivers.laboratory import parse_announcement
from drivers.reference.protocol import PoseParser
from drivers.star_camera.port import StarCamera
from drivers.valve_bus.port import ValveBusPort
from drivers.valve_bus.protocol import Arm, CanFrame, ValveStatus, decode, encode
from firmware_emulator.device_kind import PictureOrder
from firmware_emulator.devices.star_camera import Exposure
from firmware_emulator.live.cameras import CameraProcess
from firmware_emulator.live.command_line import main
from firmware_emulator.live.pty_port import PtyPort
from firmware_emulator.live.slcan import SlcanSession, encode_frame
from firmware_emulator.live.tcp_server import MAX_WAITING_BYTES, TcpServer

FAST = {
    "name": "alpha",
    "imu": {"averaging": 10, "ftdi_latency_ms": 1},
    "camera": {"rate_hz": 20.0, "delay_s": 0.05},
}


def frames_of(port, parser, count):
    got = []
    while len(got) < count:
        _, chunk = port.read_chunk(5.0)
        assert chunk
        got += parser.feed(chunk)
    return got


def test_an_imu_driver_reads_a_live_block_and_is_answered(serving):
    with serving({"vehicles": [FAST]}) as addresses, SerialPort(str(addresses["alpha/imu"])) as port:
        parser = FrameParser(2)
        frames = [item for item in frames_of(port, parser, 20) if isinstance(item, ImuFrame)]
        steps = [(b.tick_ms - a.tick_ms) & 0xFFFF for a, b in pairwise(frames)]
        # a port that is read late, on a busy machine, loses whole frames: the driver knows how many
        assert sum(step // 10 - 1 for step in steps) == parser.counters.frames_lost
        assert {step % 10 for step in steps} == {0}
        port.write(encode_identify(7))
        answer = None
        while answer is None:  # however many samples already wait in the port
            answer = next((item for item in frames_of(port, parser, 1) if isinstance(item, Identity)), None)
        assert answer.serial_number == 1


def test_a_bus_driver_arms_a_live_node_and_several_clients_listen(serving):
    with (
        serving({"vehicles": [FAST]}) as addresses,
        ValveBusPort(addresses["valve_bus"]) as one,
        ValveBusPort(addresses["valve_bus"]) as other,
    ):
        one.send(encode(Arm(0, True)))
        for port in (one, other):
            heard = (decode(frame) for _, frame in port.frames())
            assert next(m for m in heard if isinstance(m, ValveStatus) and m.is_armed)


def test_truth_and_fixes_come_over_tcp_stamped_by_the_host_clock(serving):
    with serving({"vehicles": [FAST]}) as addresses:
        for channel in ("alpha/reference", "alpha/fixes"):
            with SerialPort(str(addresses[channel])) as port:
                pose = frames_of(port, PoseParser(), 1)[0]
            age_s = (time.monotonic_ns() - pose.stamp_source_ns) * 1e-9
            assert 0.0 < age_s < 30.0


@pytest.mark.slow
def test_pictures_come_raw_and_as_jpeg(serving, emulated_scene):
    camera = {"source": "rendered", "rate_hz": 20.0, "delay_s": 0.05, **emulated_scene}
    vehicles = [
        {**FAST, "camera": camera},
        {**FAST, "name": "beta", "start_m": [1.0, 0.0], "camera": {**camera, "stream": "mjpeg"}},
    ]
    with serving({"vehicles": vehicles}) as addresses:
        assert str(addresses["beta/star_camera"]).endswith("/beta.mjpeg")
        for name in ("alpha", "beta"):
            with StarCamera.open(str(addresses[f"{name}/star_camera"])) as port:
                pictures = [port.read(10.0) for _ in range(4)]
            assert all(picture.image.shape == (480, 640) for picture in pictures)
            assert max(int(picture.image.max()) for picture in pictures) > 60
            numbers = [picture.sequence for picture in pictures]
            assert numbers == sorted(set(numbers))


@pytest.mark.slow
def test_a_killed_camera_process_comes_back_on_its_port(emulated_scene):
    arguments = {"exposure_s": 0.01, "readout_s": 0.0, "sky_seed": [1], "camera_seed": [2], **emulated_scene}
    renderer = "firmware_emulator.devices.sky_renderer:SkyRenderer"
    cameras = CameraProcess([PictureOrder("alpha", renderer, arguments, "raw", 90)])
    try:
        url = cameras.url("alpha", "raw")
        first = cameras._child
        first.kill()
        first.wait()
        sequence = 0
        while cameras.restarts == 0:
            order_picture(cameras, sequence)
            sequence += 1
        with eventually_open(url) as port:
            order_picture(cameras, sequence)
            assert port.read(10.0).sequence == sequence
        assert cameras.dropped_orders > 0
    finally:
        cameras.close()
    assert cameras._child.returncode == 0


def order_picture(cameras, sequence):
    pose = (0.0, 0.0, 0.0)
    cameras.order("alpha", Exposure(sequence, pose, pose, 0, time.monotonic_ns(), False, 0))


def eventually_open(url):
    deadline_s = time.monotonic() + 30.0
    while True:
        try:
            return StarCamera.open(url)
        except NotFound:
            assert time.monotonic() < deadline_s


@pytest.fixture
def emulated_scene():
    folder = Path(__file__).parents[3] / "calibration" / "rigs" / "emulated"
    return {"ceiling": str(folder / "ceiling.csv"), "camera": str(folder / "camera.json")}


def start(tmp_path, text):
    rig = tmp_path / "rig.toml"
    rig.write_text(text)
    return subprocess.Popen(
        [sys.executable, "-m", "firmware_emulator", str(rig)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
    )


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["terminate", "stdin"])
def test_the_process_announces_its_ports_and_leaves_none_behind(tmp_path, ending):
    with start(tmp_path, '[[laboratory.vehicles]]\nname = "alpha"\n') as process:
        addresses = parse_announcement(process.stdout.readline())
        assert set(addresses) == {"laboratory", "valve_bus", "alpha/imu", "alpha/reference", "alpha/fixes"}
        pty = Path(addresses["alpha/imu"])
        assert pty.exists()
        if ending == "terminate":
            process.terminate()
        else:
            process.stdin.close()
        assert process.wait(10) == 0
        assert process.stderr.read() == ""
    assert not pty.exists()
    host, port = addresses["alpha/reference"].removeprefix("socket://").split(":")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((host, int(port)), 5)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("[laboratory", "is not valid TOML"),
        ("[station]\nx = 1\n", "has no table [laboratory]"),
        ('[[laboratory.vehicles]]\nname = "alpha"\nmas_kg = 1\n', "laboratory.vehicles.0.mas_kg"),
        ('[[laboratory.vehicles]]\nname = "alpha"\n[[laboratory.failures]]\nkind = "x"\nvehicle = "alpha"\n',
         "no failure of kind 'x'"),
        ('[[laboratory.vehicles]]\nname = "alpha"\ncamera = {source = "rendered", ceiling = "no.csv", '
         'camera = "no.json"}\n', "no.csv"),
    ],
)  # fmt: skip
def test_a_wrong_rig_gets_one_sentence_and_exit_code_2(tmp_path, capsys, text, complaint):
    rig = tmp_path / "rig.toml"
    rig.write_text(text)
    assert main([str(rig)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert complaint in captured.err
    assert captured.err.count("\n") == 1


def test_a_missing_rig_is_named(capsys):
    assert main(["/nowhere/rig.toml"]) == 2
    assert "/nowhere/rig.toml: cannot be read" in capsys.readouterr().err


def test_a_pty_passes_every_byte_value_both_ways_and_echoes_nothing():
    pty = PtyPort()
    every = bytes(range(256))
    client = os.open(pty.path, os.O_RDWR | os.O_NOCTTY)
    try:
        pty.write(every)
        assert os.read(client, 1024) == every
        os.write(client, every)
        select.select([pty], [], [], 5.0)
        assert pty.read() == every
        assert pty.read() == b""
    finally:
        os.close(client)
        pty.close()
    pty.close()


def test_an_unread_pty_drops_and_counts():
    pty = PtyPort()
    client = os.open(pty.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        sent = 0
        while pty.dropped_bytes == 0 and sent < 10_000_000:
            pty.write(bytes(100))
            sent += 100
        held = 0
        while held < sent - pty.dropped_bytes:
            select.select([client], [], [], 5.0)
            held += len(os.read(client, 65536))
        assert held == sent - pty.dropped_bytes
        assert pty.dropped_bytes > 0
    finally:
        os.close(client)
        pty.close()


def test_an_adapter_answers_as_the_manual_says():
    session = SlcanSession()
    assert session.feed(b"S6\r") == ([], b"\r")
    assert session.feed(b"t1002AABB\r") == ([], b"\x07")  # closed
    assert session.feed(b"O\rV\rN\r") == ([], b"\rV1013\rNEMU1\r")
    assert session.feed(b"t1002AA") == ([], b"")
    assert session.feed(b"BB\r") == ([CanFrame(0x100, b"\xaa\xbb")], b"z\r")
    assert session.feed(b"t9999\rtxyz\rt1003AA\r") == ([], b"\x07" * 3)
    assert session.feed(b"x" * 10_000 + b"\rC\r") == ([], b"\x07\r")
    assert not session.is_open
    assert session.refused_lines == 5
    assert encode_frame(CanFrame(0x18F, b"\x01\xff")) == b"t18F201FF\r"


def test_a_client_that_does_not_read_loses_whole_messages_and_stops_nobody():
    with selectors.SelectSelector() as selector:
        server = TcpServer(selector)
        address = ("127.0.0.1", server.port)
        with socket.create_connection(address) as slow, socket.create_connection(address) as quick:
            while len(server.clients) < 2:
                for key, _ in selector.select(5.0):
                    key.data()
            message = b"m" * 1000
            for _ in range(20_000):
                server.broadcast(message)
                received = quick.recv(1 << 20)
                assert received
                if any(client.dropped_messages for client in server.clients):
                    break
            assert any(client.dropped_messages for client in server.clients)
            assert max(len(client.waiting) for client in server.clients) <= MAX_WAITING_BYTES
            slow.close()
            while len(server.clients) == 2:
                for key, _ in selector.select(5.0):
                    key.data()
            server.broadcast(message)
            assert quick.recv(1 << 20)
        server.close()
        server.close()
