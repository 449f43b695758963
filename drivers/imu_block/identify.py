"""Asks a serial port who is there."""

import time
from dataclasses import dataclass

from drivers.errors import DeviceError, LinkLost
from drivers.imu_block.port import SerialPort
from drivers.imu_block.protocol import (
    FrameParser,
    Identity,
    ImuFrame,
    ParserCounters,
    encode_identify,
)

BAUDS = (250_000, 115_200)
LISTEN_S = 0.6
_ASK_EVERY_S = 0.2
_FRAMES_TO_KNOW = 3


@dataclass(frozen=True, slots=True)
class PortReport:
    """What one port reported.

    Attributes:
        url: the port.
        baud: bit rate at which the rest was found, the first one tried if nothing was.
        version: frame version received, None if none.
        identity: what the block reported of itself; v1 blocks cannot.
        frames_heard: sample frames while listening.
        counters: of the parser.
        problem: why the port could not be asked, or None.
    """

    url: str
    baud: int
    version: int | None
    identity: Identity | None
    frames_received: int
    counters: ParserCounters
    problem: str | None = None

    @property
    def is_imu_block(self) -> bool:
        """Whether an IMU block is there."""
        return self.version is not None or self.identity is not None

    @property
    def sentence(self) -> str:
        """What is there, in words."""
        if self.problem is not None:
            return self.problem
        if self.identity is not None:
            who = self.identity
            return (
                f"IMU block, serial number {who.serial_number}, firmware {who.firmware_major}."
                f"{who.firmware_minor}, averaging {who.sample_count}"
            )
        if self.version == 1:
            return "IMU block with v1 frames (one-way: it cannot say which one it is)"
        if self.version == 2:
            return "IMU block with v2 frames that does not answer"
        if self.counters.bytes_seen:
            return f"{self.counters.bytes_seen} bytes that are no IMU block's"
        return "silent"


def ask(port: SerialPort, *, listen_s: float = LISTEN_S, tag: int = 0x51) -> PortReport:
    """Ask an open port for its identity and listen to what it sends by itself.

    Args:
        port: open port; stays open.
        listen_s: longest time to wait for an answer.
        tag: mark of the question (0..255), repeated in the answer.

    Raises:
        LinkLost: if the port goes away meanwhile.
    """
    parser = FrameParser()
    identity: Identity | None = None
    frames = 0
    version: int | None = None
    begin = time.monotonic()
    next_question = begin
    while (now := time.monotonic()) < begin + listen_s:
        if now >= next_question and version != 1:
            port.write(encode_identify(tag))
            next_question = now + _ASK_EVERY_S
        _, chunk = port.read_chunk(min(0.05, listen_s))
        for result in parser.feed(chunk):
            if isinstance(result, ImuFrame):
                frames += 1
                version = result.version
            elif isinstance(result, Identity) and result.tag == tag:
                identity = result
        if identity is not None or (version == 1 and frames >= _FRAMES_TO_KNOW):
            break
    return PortReport(port.url, port.baud, version, identity, frames, parser.counters)


def ask_url(url: str, *, bauds: tuple[int, ...] = BAUDS, listen_s: float = LISTEN_S) -> PortReport:
    """Open a port, ask it at each bit rate in turn, close it again; errors become the report's problem."""
    report: PortReport | None = None
    for baud in bauds:
        try:
            with SerialPort(url, baud) as port:
                received = ask(port, listen_s=listen_s)
        except LinkLost as error:
            return _problem(url, baud, str(error))
        except DeviceError as error:
            return report or _problem(url, baud, str(error))
        if received.is_imu_block:
            return received
        if report is None or received.counters.bytes_seen > report.counters.bytes_seen:
            report = received
        if url.startswith("socket://"):
            break  # a socket has no bit rate
    assert report is not None
    return report


def _problem(url: str, baud: int, sentence: str) -> PortReport:
    return PortReport(url, baud, None, None, 0, ParserCounters(), problem=sentence)
