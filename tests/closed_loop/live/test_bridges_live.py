"""Foxglove and ROS 2 beside a rig that flies, looked at by clients that are not ours."""

import importlib.util
import itertools
import json
import os
import queue
import re
import signal
import socket
import struct
import time

import pytest
import zenoh
from mcap_ros2._dynamic import generate_dynamic
from oracles import listening
from websockets.sync.client import connect

pytestmark = pytest.mark.slow

PATIENCE_S = 60.0
HAS_FOXGLOVE = importlib.util.find_spec("foxglove") is not None


def session(mode, endpoint):
    config = zenoh.Config()
    for key, value in {
        "mode": mode,
        "listen/endpoints": [endpoint] if mode == "router" else [],
        "connect/endpoints": [] if mode == "router" else [endpoint],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


@pytest.fixture
def router():
    """Stands in for ``rmw_zenohd``; another session looks at what comes there, as a node of ROS 2 would."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with session("router", endpoint), session("client", endpoint) as node:
        yield endpoint, node


@pytest.fixture
def flight(launch, two_drawn, router):
    words = ["--ros2", router[0], "--ros2-domain", "3"]
    if HAS_FOXGLOVE:
        words += ["--foxglove", "--foxglove-port", "0"]
    run = launch(two_drawn, *words)
    run.wait_for("publishes to the router of ROS 2")
    run.rewind()
    run.wait_until_flying()
    yield run
    run.end_in_order()


def tokens_of(node, topics):
    """Parts of every token, once the node and each of these topics have one: they come one by one."""
    came = queue.SimpleQueue()
    subscriber = node.liveliness().declare_subscriber(
        "@ros2_lv/3/**", zenoh.handlers.Callback(came.put, indirect=False), history=True
    )
    announced = set()
    while not {"NN", *topics} <= announced:
        parts = str(came.get(timeout=PATIENCE_S).key_expr).split("/")
        announced |= {parts[5], *parts[9:10]}
    subscriber.undeclare()
    return [str(reply.ok.key_expr).split("/") for reply in node.liveliness().get("@ros2_lv/3/**")]


def check_ros2(node):
    came = queue.SimpleQueue()
    key = "3/alpha/state/*/*"
    subscriber = node.declare_subscriber(key, zenoh.handlers.Callback(came.put, indirect=False))
    samples = [came.get(timeout=PATIENCE_S) for _ in range(40)]
    subscriber.undeclare()
    match = re.fullmatch(
        r"3/alpha/state/air_table_msgs::msg::dds_::VehicleState_/(RIHS01_[0-9a-f]{64})",
        str(samples[0].key_expr),
    )
    assert match
    attachments = [struct.unpack("<qqB16s", bytes(sample.attachment)) for sample in samples]
    sequences = [sequence for sequence, *_ in attachments]
    assert sequences == list(range(sequences[0], sequences[0] + 40)), "a node would report lost messages"
    assert {length for _, _, length, _ in attachments} == {16}
    (gid,) = {gid for *_, gid in attachments}
    for sample, (_, utc_ns, _, _) in zip(samples, attachments, strict=True):
        data = bytes(sample.payload)
        assert data[:4] == b"\0\1\0\0"
        seconds, nanoseconds = struct.unpack_from("<iI", data, 4)
        assert abs(seconds + 1e-9 * nanoseconds - 1e-9 * utc_ns) < 5.0, "the header has UTC, as ROS 2 expects"
        assert abs(time.time() - 1e-9 * utc_ns) < 60.0
    parts = tokens_of(node, {"%alpha%state", "%alpha%wrench", "%beta%state", "%alpha%supervision", "%lease"})
    assert all(all(part for part in token) for token in parts)
    (our_node,) = [token for token in parts if token[5] == "NN"]
    assert our_node[8] == "ground_station"
    publishers = [token for token in parts if token[5] == "MP"]
    numbers = [token[4] for token in publishers]
    assert len(set(numbers)) == len(numbers)
    (state,) = [token for token in publishers if token[9] == "%alpha%state"]
    assert state[10:] == ["air_table_msgs::msg::dds_::VehicleState_", match[1], "::,10:,:,:,,"]
    (wrench,) = [token for token in publishers if token[9] == "%alpha%wrench"]
    assert wrench[11] == "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"
    return gid


def check_foxglove(url):
    """A client of the published protocol: JSON texts, then binary frames of opcode 1."""
    with connect(url, subprotocols=["foxglove.sdk.v1"], open_timeout=PATIENCE_S) as viewer:
        assert viewer.subprotocol == "foxglove.sdk.v1"
        info = json.loads(viewer.recv(PATIENCE_S))
        assert (info["op"], info["name"]) == ("serverInfo", "two mock-ups, drawn fixes")
        channels = {}
        while not {"/alpha/state", "/beta/state", "/lease", "/tf", "/table"} <= channels.keys():
            text = viewer.recv(PATIENCE_S)
            if isinstance(text, str) and json.loads(text)["op"] == "advertise":
                channels |= {channel["topic"]: channel for channel in json.loads(text)["channels"]}
        state = channels["/alpha/state"]
        assert (state["encoding"], state["schemaEncoding"]) == ("cdr", "ros2msg")
        assert state["schemaName"] == "air_table_msgs/msg/VehicleState"
        read = generate_dynamic(state["schemaName"], state["schema"])[state["schemaName"]]
        wanted = [state["id"], channels["/tf"]["id"], channels["/table"]["id"]]
        viewer.send(
            json.dumps(
                {
                    "op": "subscribe",
                    "subscriptions": [{"id": n, "channelId": channel} for n, channel in enumerate(wanted)],
                }
            )
        )
        came = {n: [] for n in range(3)}
        until_s = time.monotonic() + PATIENCE_S
        while min(map(len, came.values())) < 1 or len(came[0]) < 20:
            assert time.monotonic() < until_s
            frame = viewer.recv(PATIENCE_S)
            if isinstance(frame, bytes) and frame[0] == 1:
                subscription, log_ns = struct.unpack_from("<IQ", frame, 1)
                came[subscription].append((log_ns, frame[13:]))
        assert channels["/tf"]["schemaName"] == "foxglove.FrameTransform"
        assert channels["/table"]["schemaName"] == "foxglove.SceneUpdate"
        for log_ns, data in came[0]:
            message = read(data)
            assert message.header.frame_id == "alpha"
            assert abs(message.position_table_m[0] + 0.6) < 0.3
            assert abs(time.time() - 1e-9 * log_ns) < 60.0
        stamps = [log_ns for log_ns, _ in came[0]]
        assert all(later > earlier for earlier, later in itertools.pairwise(stamps))


def test_both_show_the_flight_and_a_bridge_that_is_killed_comes_back(flight, router):
    first = check_ros2(router[1])
    if HAS_FOXGLOVE:
        flight.rewind()
        url = flight.wait_for("foxglove: ws://").rpartition(" ")[2]
        check_foxglove(url)
    listened = listening.listened_on(flight.every_pid())
    assert not [each for each in listened if not listening.is_loopback(each[1])]
    flight.forget()
    os.kill(flight.pids()["ros2"], signal.SIGKILL)
    flight.wait_for("publishes to the router of ROS 2")
    assert check_ros2(router[1]) != first, "another session, another publisher"
