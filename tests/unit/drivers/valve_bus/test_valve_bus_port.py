import queue
import socket
import threading
from contextlib import contextmanager, suppress

import can
import pytest

from drivers.errors import LinkLost, NotFound
from drivers.valve_bus.port import ValveBusPort
from drivers.valve_bus.protocol import Arm, CanFrame, FloatAir, Stop, ValveCommand, decode, encode

PATIENCE_S = 20.0
STATUS = CanFrame(0x181, bytes.fromhex("815399000802"))
COMMAND = encode(ValveCommand(1, 3, 5, (10, 0, 127, 0, 0, 50, 0, 1)))


class Adapter:
    """The far side of a slcan adapter behind a socket: lines in, lines out (Lawicel ASCII)."""

    def __init__(self, server):
        self.lines = queue.Queue()
        self.connected = threading.Event()
        self._server = server
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self):
        self._client, _ = self._server.accept()
        self.connected.set()
        # After a hang-up the port's last lines meet a closed connection, and the reset may come back here.
        with suppress(ConnectionResetError), self._client.makefile("rb") as stream:
            line = bytearray()
            while byte := stream.read(1):
                if byte == b"\r":
                    self.lines.put(bytes(line))
                    line.clear()
                else:
                    line += byte

    def say(self, data):
        assert self.connected.wait(PATIENCE_S)
        self._client.sendall(data)

    def hang_up(self):
        self.connected.wait(PATIENCE_S)
        self._client.shutdown(socket.SHUT_RDWR)

    def close(self):
        self._thread.join(PATIENCE_S)
        self._client.close()


@contextmanager
def slcan():
    with socket.create_server(("127.0.0.1", 0)) as server:
        adapter = Adapter(server)
        config = {
            "interface": "slcan",
            "channel": f"socket://127.0.0.1:{server.getsockname()[1]}",
            "bitrate": 500000,
        }
        with ValveBusPort(config) as port:
            yield port, adapter
        adapter.close()


@pytest.fixture
def bus():
    """A port and the node at the other end of a virtual bus."""
    config = {"interface": "virtual", "channel": "valves of a test"}
    with ValveBusPort(config) as port, can.Bus(**config, ignore_config=True) as node:
        yield port, node


def test_frames_pass_both_ways(bus):
    port, node = bus
    port.send(COMMAND)
    heard = node.recv(PATIENCE_S)
    assert CanFrame(heard.arbitration_id, bytes(heard.data)) == COMMAND
    assert not heard.is_extended_id
    node.send(can.Message(arbitration_id=STATUS.arbitration_id, data=STATUS.data, is_extended_id=False))
    stamp_ns, frame = port.read(PATIENCE_S)
    assert frame == STATUS
    assert stamp_ns > 0
    assert (port.counters.sent, port.counters.received) == (1, 1)


def test_nothing_in_time_is_none(bus):
    assert bus[0].read(0.0) is None


def test_what_a_station_said_and_what_is_no_data_frame_is_passed_over(bus):
    port, node = bus
    for echo in (COMMAND, encode(FloatAir(1, is_on=True))):
        node.send(can.Message(arbitration_id=echo.arbitration_id, data=echo.data, is_extended_id=False))
    node.send(can.Message(arbitration_id=0x181, is_extended_id=True, data=STATUS.data))
    node.send(can.Message(arbitration_id=0x181, is_extended_id=False, is_remote_frame=True))
    node.send(can.Message(arbitration_id=0x181, data=STATUS.data, is_extended_id=False))
    assert port.read(PATIENCE_S)[1] == STATUS
    assert (port.counters.own_echoes, port.counters.foreign) == (2, 2)


def test_closing_ends_the_frames_of_another_thread():
    port = ValveBusPort({"interface": "virtual", "channel": "a bus to be closed"})
    frames = []
    reader = threading.Thread(target=lambda: frames.extend(port.frames()))
    reader.start()
    port.close()
    port.close()
    reader.join(PATIENCE_S)
    assert not reader.is_alive()
    assert frames == []
    for use in (lambda: port.read(0.0), lambda: port.send(COMMAND)):
        with pytest.raises(LinkLost, match="is closed"):
            use()


@pytest.mark.parametrize("missing", ["interface", "channel"])
def test_a_missing_key_is_named(missing):
    config = {"interface": "virtual", "channel": "x"}
    del config[missing]
    with pytest.raises(ValueError, match=missing):
        ValveBusPort(config)


@pytest.mark.parametrize(
    "config",
    [
        {"interface": "no such interface", "channel": "x"},
        {"interface": "slcan", "channel": "/dev/no_such_tty", "sleep_after_open": 0.0},
        {"interface": "slcan", "channel": "socket://nowhere"},
    ],
    ids=lambda config: config["channel"],
)
def test_an_adapter_that_is_not_there_is_not_found(config):
    with pytest.raises(NotFound, match="cannot be opened"):
        ValveBusPort(config)


def test_a_slcan_adapter_behind_a_socket_is_opened_used_and_left():
    with slcan() as (port, adapter):
        port.send(COMMAND)
        port.send(COMMAND)
        lines = [adapter.lines.get(timeout=PATIENCE_S) for _ in range(6)]
        assert b"S6" in lines  # 500 kbit/s
        assert b"O" in lines
        while lines[-1][:1] != b"t":
            lines.append(adapter.lines.get(timeout=PATIENCE_S))
        assert lines[-1] == b"t1018530AC01F00900102"
        adapter.say(b"\rz\rt1816815399000802\r")
        assert port.read(PATIENCE_S)[1] == STATUS
        assert decode(STATUS).is_armed


def test_noise_on_the_adapters_line_is_counted_and_costs_no_good_frame():
    noises = (b"t18\r", b"tzzz1\r", b"\xff\xfe\xfd\r", b"t1819" + b"00" * 9 + b"\r", b"tFFF0\r")
    with slcan() as (port, adapter):
        for count, noise in enumerate(noises, start=1):
            adapter.say(noise)
            while port.counters.garbled < count:
                assert port.read(0.1) is None
            adapter.say(b"t1816815399000802\r")
            assert port.read(PATIENCE_S)[1] == STATUS
            assert port.counters.garbled == count


def test_an_adapter_that_hangs_up_is_a_lost_link():
    with slcan() as (port, adapter):
        adapter.hang_up()
        with pytest.raises(LinkLost, match="is lost"):
            for _ in port.frames():
                pass


@pytest.mark.parametrize("interface", sorted(can.VALID_INTERFACES))
def test_a_back_end_without_its_library_or_adapter_is_not_found_in_a_sentence(interface):
    config = {"interface": interface, "channel": "no_such_channel", "sleep_after_open": 0.0}
    if interface == "virtual":  # takes any channel
        ValveBusPort(config).close()
        return
    with pytest.raises(NotFound) as refused:
        ValveBusPort(config)
    assert str(refused.value).startswith(f"the valve bus on {interface} no_such_channel cannot be opened: ")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "channel", ["socket://nowhere", "socket://", "socket://:4000", "socket://a:b", "socket://a:99999"]
)
def test_a_socket_without_a_port_is_named(channel):
    with pytest.raises(NotFound, match=r"expected socket://HOST:PORT"):
        ValveBusPort({"interface": "slcan", "channel": channel})


class FullQueue:
    """Stands for a socketcan queue that is full for a while: what was tried meanwhile is refused."""

    def __init__(self, port, refusals):
        self._send, self.refusals, self.sent = port._bus.send, refusals, []

    def __call__(self, message, timeout=None):
        if self.refusals > 0:
            self.refusals -= 1
            raise can.CanOperationError("Failed to transmit", 105)
        self.sent.append(message.arbitration_id)
        self._send(message, timeout)


def test_what_a_full_queue_refuses_is_sent_later(bus, monkeypatch):
    port, node = bus
    full = FullQueue(port, refusals=3)
    monkeypatch.setattr(port._bus, "send", full)
    for frame in (COMMAND, encode(Arm(1, is_armed=False)), encode(Stop(1))):
        port.send(frame)
    heard = [node.recv(PATIENCE_S).arbitration_id for _ in range(3)]
    assert sorted(heard) == [0x001, 0x041, 0x101]
    assert port.counters.lost == 0


def test_a_queue_that_stays_full_is_a_lost_link_after_its_time_and_what_was_lost_is_counted(bus, monkeypatch):
    port, _ = bus
    monkeypatch.setattr(port._bus, "send", FullQueue(port, refusals=1 << 30))

    def send_on():
        while True:
            port.send(COMMAND)

    with pytest.raises(LinkLost, match=r"has taken no frame for 0.1 s"):
        send_on()
    assert port.counters.sent == 0
    assert port.counters.lost > 0


def test_a_stop_of_somebody_else_passes_and_ones_own_does_not(bus):
    port, node = bus
    port.send(encode(Stop(1)))
    for stop in (Stop(1), Stop(2, reason=1)):
        frame = encode(stop)
        node.send(can.Message(arbitration_id=frame.arbitration_id, data=frame.data, is_extended_id=False))
    assert port.read(PATIENCE_S)[1] == encode(Stop(2, reason=1))
    assert port.counters.own_echoes == 1


@pytest.mark.parametrize("flood_id", [0x181, 0x701])
def test_a_flood_becomes_its_newest_frames_and_a_count(flood_id):
    with slcan() as (port, adapter):
        lines = [b"t%03X8%016X\r" % (flood_id, count) for count in range(8000)]
        adapter.say(b"".join(lines) + b"t2816815399000802\r")
        arrivals, last = [], None
        while last != 0x281:
            arrivals += port.read_newest(PATIENCE_S)
            last = arrivals[-1].frame.arbitration_id
        assert sum(arrival.passed for arrival in arrivals) >= 8001
        assert len(arrivals) < 400
        kept = [arrival.frame for arrival in arrivals if arrival.frame.arbitration_id == 0x181]
        if flood_id == 0x181:
            assert int.from_bytes(kept[-1].data, "big") == 7999
        else:
            assert kept == []
            assert port.counters.foreign == 8000
