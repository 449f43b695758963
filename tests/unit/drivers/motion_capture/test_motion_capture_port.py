"""The port against a library that is not there, lies, dies or hangs: a stand-in of the same face."""

import json
import os
import signal
import time

import pytest

from drivers.errors import LinkLost, NotFound
from drivers.motion_capture import port as module
from drivers.motion_capture.port import MotionCapturePort

STAND_IN = """
import json, os, time
from types import SimpleNamespace

print("a library that talks on stdout")

class Source:
    def __init__(self, frames):
        self.frames = iter(frames)
        self.rigidBodies = {}

    def waitForNextFrame(self):
        frame = next(self.frames, "silence")
        if frame == "silence":
            time.sleep(60.0)  # a system that falls silent: the library blocks for good, and is killed
        if frame == "crash":
            os.kill(os.getpid(), 11)
        if frame == "throw":
            raise RuntimeError("the wire was cut")
        self.rigidBodies = {
            name: SimpleNamespace(position=[x, 0, 0], rotation=SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0))
            for name, x in frame.items()
        }

def connect(system, arguments):
    if "refuse" in arguments:
        raise RuntimeError(arguments["refuse"])
    if "hang" in arguments:
        time.sleep(60.0)  # a system that does not answer: connecting blocks for good, and is killed
    return Source(json.loads(arguments["frames"]))
"""


@pytest.fixture
def library(tmp_path, monkeypatch):
    (tmp_path / "motioncapture.py").write_text(STAND_IN)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))


def config(frames=(), **more):
    return {"system": "optitrack", "hostname": "127.0.0.1", "frames": json.dumps(list(frames)), **more}


def test_without_the_library_a_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    with pytest.raises(NotFound, match=r"not installed: install the extra mocap"):
        MotionCapturePort(config())


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({}, "system is missing; the systems are optitrack"),
        ({"system": "sonar"}, "system is 'sonar'; the systems are"),
        ({"system": "vicon"}, "vicon needs the key 'hostname'"),
    ],
)
def test_a_wrong_configuration_is_refused_in_a_sentence(wrong, complaint):
    with pytest.raises(ValueError, match=complaint):
        MotionCapturePort(wrong)


@pytest.mark.usefixtures("library")
def test_poses_come_with_stamps_of_their_frames_arrival():
    before_ns = time.monotonic_ns()
    with MotionCapturePort(config([{"a": 1.0, "b": 2.0}, {"b": 3.0}])) as port:
        arrivals = [port.read(5.0) for _ in range(4)]
    stamps = [stamp_ns for stamp_ns, _ in arrivals]
    assert before_ns < stamps[0] == stamps[1] <= stamps[2] == stamps[3] < time.monotonic_ns()
    assert [(p.name, p.frame, p.is_tracked) for _, p in arrivals] == [
        ("a", 0, True), ("b", 0, True), ("b", 1, True), ("a", 1, False),
    ]  # fmt: skip
    assert arrivals[2][1].position_m == (3.0, 0.0, 0.0)


@pytest.mark.usefixtures("library")
def test_only_bodies_that_were_asked_for_come():
    with MotionCapturePort(config([{"a": 1.0, "b": 2.0}]), ["b"]) as port:
        assert port.read(5.0)[1].name == "b"
        assert port.read(0.01) is None
        assert (port.counters.frames, port.counters.poses, port.counters.foreign) == (1, 1, 1)


@pytest.mark.usefixtures("library")
def test_vrpn_knows_no_frames_so_that_nothing_is_no_news():
    with MotionCapturePort({**config([{"a": 1.0}, {}, {"a": 2.0}]), "system": "vrpn"}) as port:
        poses = [port.read(5.0)[1] for _ in range(2)]
    assert [(pose.is_tracked, pose.position_m[0]) for pose in poses] == [(True, 1.0), (True, 2.0)]


@pytest.mark.usefixtures("library")
def test_what_the_library_refuses_is_not_found_with_its_reason():
    with pytest.raises(NotFound, match=r"optitrack at 127\.0\.0\.1 does not answer: Error connecting"):
        MotionCapturePort(config(refuse="Error connecting"))


@pytest.mark.usefixtures("library")
def test_a_system_that_does_not_answer_is_given_up():
    with pytest.raises(NotFound, match=r"does not answer within 0\.1 s"):
        MotionCapturePort(config(hang="1"), connect_s=0.1)


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize(
    ("end", "complaint"),
    [("silence", r"has sent no frame for 0\.2 s"), ("crash", "ended"), ("throw", "the wire was cut")],
)
def test_a_system_that_goes_away_is_a_lost_link(end, complaint):
    with MotionCapturePort(config([{"a": 1.0}, end]), silence_s=0.2) as port:
        assert port.read(5.0)[1].name == "a"
        with pytest.raises(LinkLost, match=complaint):
            port.read(5.0)


@pytest.mark.usefixtures("library")
def test_who_does_not_read_loses_old_poses_and_learns_how_many(monkeypatch):
    monkeypatch.setattr(module, "_MAX_WAITING", 3)
    with MotionCapturePort(config([{"a": float(x)} for x in range(10)])) as port:
        while port.counters.frames < 10:
            port._news.acquire()
            port._news.wait(1.0)
            port._news.release()
        assert [port.read(1.0)[1].position_m[0] for _ in range(3)] == [7.0, 8.0, 9.0]
        assert port.counters.dropped == 7


@pytest.mark.usefixtures("library")
def test_a_closed_port_ends_its_process_and_its_readers():
    port = MotionCapturePort(config([{"a": 1.0}]), silence_s=30.0)
    poses = port.poses()
    assert next(poses)[1].name == "a"
    port.close()
    port.close()
    assert list(poses) == []
    assert port._child.returncode == 0
    with pytest.raises(LinkLost, match="closed"):
        port.read(1.0)


@pytest.mark.usefixtures("library")
def test_a_reader_that_is_stuck_is_killed():
    port = MotionCapturePort(config([{"a": 1.0}]))
    os.kill(port._child.pid, signal.SIGSTOP)
    os.waitid(os.P_PID, port._child.pid, os.WSTOPPED | os.WNOWAIT)
    port.close()
    assert port._child.returncode == -signal.SIGKILL
