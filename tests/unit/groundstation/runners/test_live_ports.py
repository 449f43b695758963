"""A port's thread: whatever its edge does is reported to the loop, and no thread dies unseen."""

import sys
from dataclasses import dataclass

import pytest

from groundstation.declarations.port import Edge, Port
from groundstation.parts.imu.messages import ImuBytes
from groundstation.runners.live_ports import PortThread


def leave():
    sys.exit("enough")


def divide():
    return 1 // 0


class Broken(Edge):
    def __init__(self, fault):
        self._fault = fault
        self.is_closed = False

    def read(self):
        self._fault()

    def write(self, payload):
        raise NotImplementedError

    def close(self):
        self.is_closed = True


@dataclass(frozen=True)
class BrokenPort(Port):
    edge: Edge

    reads = ImuBytes

    def open(self):
        return self.edge

    def to_message(self, stamp_ns, data):
        raise NotImplementedError


@pytest.mark.parametrize(
    ("fault", "kind", "sentence"),
    [
        (leave, RuntimeError, "alpha/imu: its edge asks to exit (enough)"),
        (divide, ZeroDivisionError, "integer division or modulo by zero"),
    ],
)
def test_an_edge_that_fails_or_exits_is_handed_to_the_loop_and_closed(fault, kind, sentence):
    edge = Broken(fault)
    crashes = []
    port = BrokenPort("alpha/imu", "alpha", None, edge)
    PortThread(port, lambda *_: None, lambda *_: None, crashes.append).run()
    (crash,) = crashes
    assert type(crash) is kind
    assert str(crash) == sentence
    assert edge.is_closed
