"""The emulated motion-capture system on the wire, and the real client library against it."""

import socket
import struct
from importlib.util import find_spec

import pytest
from scipy.spatial.transform import Rotation

from drivers.laboratory import InjectOrder, encode_order
from drivers.motion_capture.port import MotionCapturePort
from drivers.motion_capture.pose import MotionCapturePose
from firmware_emulator.live.natnet import (
    MessageId,
    encode_frame,
    encode_model,
    encode_server_info,
    parse_request,
)

CONNECT, MODEL_REQUEST = bytes.fromhex("00000000"), bytes.fromhex("04000000")
needs_library = pytest.mark.skipif(find_spec("motioncapture") is None, reason="needs the extra mocap")


def scenario(**settings):
    alpha = {"name": "alpha", "start_m": [0.5, -0.25], "start_heading_deg": 30.0}
    exact = {"sigma_m": 0.0, "sigma_rad": 0.0, **settings}
    return {"vehicles": [alpha, {"name": "beta", "start_m": [-1.0, 0.0]}], "motion_capture": exact}


def test_a_frame_is_laid_out_as_the_samples_of_the_sdk_read_it():
    """Written by hand after PacketClient.cpp of the NatNet SDK, protocol 3.1, a server without markers."""
    seen = MotionCapturePose("a", 7, (1.0, 2.0, -0.5), (0.0, 0.0, 0.6, 0.8), is_tracked=True)
    hidden = MotionCapturePose.untracked("b", 7)
    datagram = encode_frame([seen, hidden], [1, 2], exposed_ns=2_000_000_000, sent_ns=2_008_000_000)
    assert datagram == bytes.fromhex(
        "0700 9a00"  # frame of data, 154 bytes
        "07000000 00000000 00000000 02000000"  # number, marker sets, other markers, rigid bodies
        "01000000 0000803f 00000040 000000bf"  # id, x, y, z
        "00000000 00000000 9a99193f cdcc4c3f 00000000 0100"  # qx, qy, qz, qw, marker error, tracked
        "02000000 00000000 00000000 00000000"
        "00000000 00000000 00000000 00000000 00000000 0000"
        "00000000 00000000 00000000 00000000"  # skeletons, labelled markers, force plates, devices
        "00000000 00000000 0000000000000040"  # timecode and its subframe, timestamp 2.0 s
        "0094357700000000 00a6af7700000000 00a6af7700000000"  # exposed, received, sent, in ticks
        "0000 00000000"  # flags, end of data
    )


def test_a_model_is_laid_out_as_the_samples_of_the_sdk_read_it():
    """Of each data set: a rigid body, its name, number, parent, pivot offset, count of markers."""
    model = bytes.fromhex(
        "0500 4500 02000000"  # model, 69 bytes, two data sets
        "01000000 6100 01000000 ffffffff 00000000 00000000 00000000 00000000"
        "01000000 426f6479203200 02000000 ffffffff 00000000 00000000 00000000 00000000"
    )
    assert encode_model(["a", "Body 2"]) == model


def test_a_server_says_its_versions_clock_and_data_port():
    info = encode_server_info(1511)
    assert info[:4] == bytes.fromhex("0100 1701")  # server info, 279 bytes
    assert info[4:260].rstrip(b"\0") == b"Motive"
    assert info[260:] == bytes.fromhex("03010000 03010000 00ca9a3b00000000 e705 00 00000000")


@pytest.mark.parametrize(
    "datagram", [b"", b"\0", bytes.fromhex("0200 0000"), bytes.fromhex("0700 0000"), b"\xff" * 50]
)
def test_what_is_no_request_is_not_answered(datagram):
    assert parse_request(datagram) is None


def test_requests_are_known():
    assert parse_request(CONNECT) is MessageId.CONNECT
    assert parse_request(MODEL_REQUEST) is MessageId.MODEL_REQUEST


def test_a_client_of_bare_sockets_is_told_its_port_and_gets_frames_there(serving):
    with serving(scenario()) as addresses, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as command:
        command.settimeout(5.0)
        server = ("127.0.0.1", int(addresses["motion_capture"]["port_command"]))
        command.sendto(b"noise", server)
        command.sendto(MODEL_REQUEST, server)
        assert command.recv(65_535) == encode_model(["alpha", "beta"])
        command.sendto(CONNECT, server)
        (data_port,) = struct.unpack_from("<H", command.recv(65_535), 4 + 256 + 8 + 8)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as data:
            data.settimeout(5.0)
            data.bind(("127.0.0.1", data_port))
            one, other = data.recv(65_535), data.recv(65_535)
    numbers = [struct.unpack_from("<i", datagram, 4)[0] for datagram in (one, other)]
    assert numbers[1] == numbers[0] + 1
    body, x, y = struct.unpack_from("<iff", one, 20)
    assert (body, x, y) == (1, pytest.approx(0.5), pytest.approx(-0.25))


@needs_library
@pytest.mark.parametrize("up", ["z", "y"])
def test_the_real_client_reads_the_poses(serving, up):
    with (
        serving(scenario(up=up, names={"beta": "Rigid Body 2"})) as addresses,
        MotionCapturePort(addresses["motion_capture"]) as port,
    ):
        arrivals = [port.read(5.0) for _ in range(20)]
    names = {pose.name: pose for _, pose in arrivals}
    assert set(names) == {"alpha", "Rigid Body 2"}
    place = {"z": (0.5, -0.25, 0.3), "y": (0.5, 0.3, 0.25)}[up]
    assert names["alpha"].position_m == pytest.approx(place, abs=1e-6)
    turn = Rotation.from_quat(names["alpha"].quaternion_xyzw).as_rotvec(degrees=True)
    assert turn == pytest.approx({"z": (0.0, 0.0, 30.0), "y": (0.0, 30.0, 0.0)}[up], abs=1e-3)
    stamps = [stamp_ns for stamp_ns, _ in arrivals]
    assert stamps == sorted(stamps)
    assert port.counters.garbled == 0


@needs_library
def test_several_real_clients_read_at_once_and_only_what_they_ask_for(serving):
    with (
        serving(scenario()) as addresses,
        MotionCapturePort(addresses["motion_capture"], ["alpha"]) as one,
        MotionCapturePort(addresses["motion_capture"], ["beta"]) as other,
    ):
        for port, name in ((one, "alpha"), (other, "beta")):
            assert {port.read(5.0)[1].name for _ in range(5)} == {name}


@needs_library
def test_the_real_client_knows_a_hidden_body(serving):
    with serving(scenario()) as addresses, MotionCapturePort(addresses["motion_capture"], ["alpha"]) as port:
        assert port.read(5.0)[1].is_tracked
        host, tcp_port = addresses["laboratory"].removeprefix("socket://").split(":")
        with socket.create_connection((host, int(tcp_port)), 5.0) as client:
            client.sendall(encode_order(InjectOrder("hidden_body", "alpha")))
            while port.read(5.0)[1].is_tracked:
                pass
            assert not port.read(5.0)[1].is_tracked
