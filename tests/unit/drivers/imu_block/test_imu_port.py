"""Real ports: ptys and sockets, blocks that answer, blocks that cannot, and noise."""

import contextlib
import os
import pty
import select
import socket
import threading
import time
import tty
from pathlib import Path

import pytest
from typer.testing import CliRunner

from drivers.errors import LinkLost, NotFound, Refused
from drivers.imu_block.identify import ask_url
from drivers.imu_block.port import SerialPort
from drivers.imu_block.protocol import CommandParser, Identify, Identity, encode_reply, encode_v1, encode_v2
from groundstation.cli.devices import app
from groundstation.declarations.errors import UsageError


@pytest.fixture
def line():
    """A raw pty: the block's end as descriptor, the host's end as path."""
    block, host = pty.openpty()
    tty.setraw(host)
    yield block, os.ttyname(host)
    for descriptor in (block, host):
        with contextlib.suppress(OSError):
            os.close(descriptor)


class Block(threading.Thread):
    """Sends frames and answers identify, until told to end."""

    def __init__(self, descriptor, send, serial_number=None):
        super().__init__(daemon=True)
        self._descriptor, self._send, self._serial_number = descriptor, send, serial_number
        self._end_read, self._end_write = os.pipe()

    def run(self):
        parser = CommandParser()
        count = 0
        while True:
            ready, _, _ = select.select([self._descriptor, self._end_read], [], [], 0.004)
            if self._end_read in ready:
                return
            if self._descriptor in ready:
                for command in parser.feed(os.read(self._descriptor, 64)):
                    if isinstance(command, Identify) and self._serial_number is not None:
                        reply = encode_reply(Identity(command.tag, 2, 1, 3, self._serial_number, 4))
                        os.write(self._descriptor, reply)
            count += 1
            os.write(self._descriptor, self._send(count))

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        os.write(self._end_write, b"e")
        self.join(5)
        os.close(self._end_read)
        os.close(self._end_write)


def v2(count):
    return encode_v2(
        tick_ms=4 * count, sample_count=4, gyro_counts=2048, tilt_counts=(1024,) * 4, housekeeping=(0, 2048)
    )


def v1(count):
    return encode_v1(sequence=count, gyro_counts=2048, tilt_difference_counts=(0, 0))


@pytest.mark.parametrize("baud", [115_200, 250_000])
def test_bytes_pass_a_pty_both_ways_at_both_bit_rates(line, baud):
    block, path = line
    with SerialPort(path, baud) as port:
        assert port.is_low_latency is False
        assert port.latency_timer_s is None
        before = time.monotonic_ns()
        os.write(block, bytes(range(256)))
        stamp_ns, data = port.read_chunk(2.0)
        assert data == bytes(range(256))
        assert before <= stamp_ns <= time.monotonic_ns()
        port.write(b"\x00\x11\x13\xff\n\r")
        assert os.read(block, 64) == b"\x00\x11\x13\xff\n\r"


def test_a_silent_line_gives_no_bytes_after_the_time_out(line):
    with SerialPort(line[1]) as port:
        assert port.read_chunk(0.0)[1] == b""


def test_a_waiting_reader_is_woken(line):
    with SerialPort(line[1]) as port:
        threading.Timer(0.01, port.wake).start()
        assert port.read_chunk(30.0)[1] == b""


def test_a_socket_is_read_in_blocks():
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = f"socket://127.0.0.1:{server.getsockname()[1]}"
        with SerialPort(url) as port:
            peer, _ = server.accept()
            with peer:
                peer.sendall(bytes(1000))
                assert len(port.read_chunk(2.0)[1]) > 1
            with pytest.raises(LinkLost, match="went away"):
                list(iter(lambda: port.read_chunk(2.0)[1], None))


def test_a_port_whose_other_end_closes_is_lost(line):
    block, path = line
    with SerialPort(path) as port:
        os.close(block)
        with pytest.raises(LinkLost, match="went away"):
            port.read_chunk(2.0)


def test_a_port_has_one_owner(line):
    with SerialPort(line[1]), pytest.raises(Refused, match="already in use"):
        SerialPort(line[1])


def test_a_port_that_is_not_there_is_named():
    with pytest.raises(NotFound, match="no serial port /dev/ttyNONE7"):
        SerialPort("/dev/ttyNONE7")
    with pytest.raises(NotFound, match="cannot be opened"):
        SerialPort("socket://127.0.0.1:1")


@pytest.mark.parametrize("scheme", ["socket", "rfc2217"])
@pytest.mark.parametrize("rest", ["host", "", ":5", "host:x", "h:70000"])
def test_a_socket_without_a_port_is_refused_in_a_sentence(scheme, rest):
    words = rf"^{scheme}://.* is no address of a socket: expected {scheme}://HOST:PORT"
    with pytest.raises(Refused, match=words):
        SerialPort(f"{scheme}://{rest}")


def test_an_option_that_pyserial_does_not_know_is_refused_in_a_sentence():
    with pytest.raises(Refused, match=r"^loop://\?logging=x does not open at 250000 Bd: "):
        SerialPort("loop://?logging=x")


def test_the_timer_is_what_the_kernel_reports(line, tmp_path, monkeypatch):
    folder = tmp_path / Path(line[1]).name
    folder.mkdir()
    (folder / "latency_timer").write_text("1\n")
    monkeypatch.setattr("drivers.imu_block.port.USB_SERIAL", tmp_path)
    with SerialPort(line[1]) as port:
        assert port.latency_timer_s == 0.001


def test_a_file_is_no_serial_port(tmp_path):
    path = tmp_path / "not_a_port"
    path.write_bytes(b"")
    with pytest.raises((NotFound, Refused), match="not_a_port"):
        SerialPort(str(path))


def test_closing_twice_is_harmless_and_leaves_no_descriptor(line):
    count = len(list(Path("/proc/self/fd").iterdir()))
    port = SerialPort(line[1])
    port.close()
    port.close()
    assert len(list(Path("/proc/self/fd").iterdir())) == count


def test_a_v2_block_says_who_it_is(line):
    with Block(line[0], v2, serial_number=1234567):
        report = ask_url(line[1], listen_s=5)
    assert report.identity is not None
    assert report.identity.serial_number == 1234567
    assert report.sentence == "IMU block, serial number 1234567, firmware 1.3, averaging 4"


@pytest.mark.parametrize(
    ("send", "words", "version"),
    [
        (v1, "v1 frames", 1),
        (v2, "v2 frames that does not answer", 2),
        (lambda count: bytes([17, 200, 3, count & 0xFF]), "no IMU block", None),
        (lambda count: b"", "silent", None),
    ],
    ids=["v1", "mute v2", "noise", "silence"],
)
def test_a_port_without_an_answer_is_described(line, send, words, version):
    with Block(line[0], send):
        report = ask_url(line[1], bauds=(250_000,), listen_s=0.3)
    assert report.version == version
    assert words in report.sentence
    assert report.is_imu_block is (version is not None)


def test_the_command_lists_who_is_there(line):
    with Block(line[0], v2, serial_number=42):
        result = CliRunner().invoke(app, [line[1], "--json", "--listen-s", "5"])
    assert result.exit_code == 0
    assert '"serial_number": 42' in result.stdout


def test_the_command_refuses_a_port_that_is_not_there_in_one_sentence():
    result = CliRunner().invoke(app, ["/dev/ttyNONE7"])
    assert isinstance(result.exception, UsageError)
    assert str(result.exception) == "there is no serial port /dev/ttyNONE7"
    assert result.stdout == ""
    assert isinstance(CliRunner().invoke(app, ["x", "--baud", "0"]).exception, UsageError)
