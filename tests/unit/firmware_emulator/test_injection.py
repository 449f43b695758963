"""Failures that are ordered at run time: reported as they begin and end, felt by every device, or refused."""

import json
import math
import socket
from dataclasses import replace

import pytest

from drivers.imu_block.protocol import encode_identify
from drivers.laboratory import FailureEvent, FailureRefused, InjectOrder, encode_order, parse_event
from drivers.valve_bus.protocol import Arm, ValveCommand, encode
from firmware_emulator.failures import FAILURE_KINDS
from firmware_emulator.laboratory import EmulatedLaboratory

MS = 1_000_000
S = 1_000_000_000


def scenario(**changes):
    vehicle = {"floating": True, "camera": {"rate_hz": 10.0, "delay_s": 0.05}}
    vehicles = [{"name": "alpha", **vehicle}, {"name": "beta", "start_m": [1.0, 0.0], **vehicle}]
    return {"vehicles": vehicles, **changes}


def fly(laboratory, seconds=3.0, orders=()):
    """Fires pulses in the rhythm of a guard; `orders` maps a tick of 20 ms to an order just after it."""
    orders = dict(orders)
    arrivals = []
    laboratory.deliver(0, "valve_bus", encode(Arm(0, True)))
    for tick in range(1, round(seconds * 50) + 1):
        now_ns = tick * 20 * MS
        arrivals += laboratory.advance(now_ns)
        if tick in orders:
            laboratory.deliver(now_ns + 1, "laboratory", orders[tick])
        on_times = (30,) * 4 + (0,) * 4 if tick % 5 == 0 else (0,) * 8
        command = ValveCommand(0, tick & 15, (tick // 5) & 15, on_times)
        if tick % 10 == 0:
            laboratory.deliver(now_ns, "alpha/imu", encode_identify(tick))
        laboratory.deliver(now_ns, "valve_bus", encode(command))
    return arrivals


def events(arrivals):
    return [(a.stamp_ns, a.data) for a in arrivals if a.channel == "laboratory"]


def others(arrivals):
    return [(a.stamp_ns, a.channel, repr(a.data)) for a in arrivals if a.channel != "laboratory"]


def test_a_failure_of_the_scenario_is_reported_when_it_begins_and_ends():
    row = {"kind": "leaking_valve", "vehicle": "alpha", "start_s": 0.5, "end_s": 1.25}
    laboratory = EmulatedLaboratory(scenario(failures=[{**row, "parameters": {"valve": 2}}]), seed=1)
    parameters = {"valve": 2.0, "fraction": 0.1}
    assert events(laboratory.advance(2 * S)) == [
        (S // 2, FailureEvent("leaking_valve", "alpha", parameters, is_active=True)),
        (5 * S // 4, FailureEvent("leaking_valve", "alpha", parameters, is_active=False)),
    ]


def test_events_arrive_at_the_moment_with_a_runner_that_steps_to_the_next_arrival():
    row = {"kind": "dead_sky", "vehicle": "beta", "start_s": 0.1234567, "end_s": 0.2}
    laboratory = EmulatedLaboratory(scenario(failures=[row]), seed=1)
    while (next_ns := laboratory.next_arrival_ns()) < S:
        for stamp_ns, _ in events(laboratory.advance(next_ns)):
            assert stamp_ns == next_ns
            assert stamp_ns in (123_456_700, 200_000_000)


@pytest.mark.parametrize(
    "kind", [k for k, row in FAILURE_KINDS.items() if row.device not in ("sky", "overhead")]
)
def test_a_failure_that_is_ordered_acts_as_one_of_the_scenario_does(kind):
    """Byte for byte, so every device handles failures that appear at run time."""
    parameters = {"probability_per_bit": 0.01} if kind == "bit_flips" else {}
    row = {"kind": kind, "vehicle": "alpha", "parameters": parameters}
    row |= {"start_s": 1.0 + 1e-9, "end_s": 2.0 + 1e-9}
    planned = fly(EmulatedLaboratory(scenario(failures=[row]), seed=3))
    ordered = fly(
        EmulatedLaboratory(scenario(), seed=3), orders={50: InjectOrder(kind, "alpha", parameters, for_s=1.0)}
    )
    healthy = fly(EmulatedLaboratory(scenario(), seed=3))
    assert others(ordered) == others(planned)
    assert others(ordered) != others(healthy)
    assert [stamp_ns for stamp_ns, _ in events(ordered)] == [S + 1, 2 * S + 1]
    assert repr(events(ordered)) == repr(events(planned))


def test_an_order_without_an_end_lasts():
    arrivals = fly(EmulatedLaboratory(scenario(), seed=3), orders={50: InjectOrder("silent_bus", "alpha")})
    assert [event.is_active for _, event in events(arrivals)] == [True]


def test_the_same_failure_twice_is_two():
    order = InjectOrder("leaking_valve", "alpha", {"valve": 1}, for_s=1.0)
    other = InjectOrder("leaking_valve", "alpha", {"valve": 2}, for_s=0.5)
    arrivals = fly(EmulatedLaboratory(scenario(), seed=3), orders={50: order, 60: other})
    assert [(stamp_ns, e.parameters["valve"], e.is_active) for stamp_ns, e in events(arrivals)] == [
        (1000 * MS + 1, 1.0, True),
        (1200 * MS + 1, 2.0, True),
        (1700 * MS + 1, 2.0, False),
        (2000 * MS + 1, 1.0, False),
    ]


@pytest.mark.parametrize(
    ("order", "reason"),
    [
        (InjectOrder("gremlin", "alpha"), "no failure of kind 'gremlin'; the kinds are bit_flips"),
        (InjectOrder("dead_sky", "gamma"), "no vehicle 'gamma'; there are alpha, beta"),
        (InjectOrder("dead_sky", "alpha", {"valve": 1}), "no parameter 'valve'; it has none"),
        (InjectOrder("leaking_valve", "alpha", {"valve": 1.5}), "valve .* whole number, got 1.5"),
        (InjectOrder("leaking_valve", "alpha", {"fraction": math.nan}), "fraction .* got nan"),
        (
            InjectOrder("dead_star", "alpha"),
            "'dead_star' of 'alpha' cannot happen: .* rendered pictures",
        ),
        (InjectOrder("hidden_discs", "alpha"), "cannot happen: the scenario has no section 'overhead'"),
        (InjectOrder("hidden_body", "alpha"), "cannot happen: the scenario has no section 'motion_capture'"),
        (InjectOrder("dead_sky", "alpha", for_s=0.0), "for_s must be positive"),
        (InjectOrder("dead_sky", "alpha", for_s=-1.0), "for_s must be positive"),
        (InjectOrder("dead_sky", "alpha", for_s=math.nan), "for_s must be positive"),
    ],
)
def test_an_order_that_cannot_be_obeyed_is_refused_in_a_sentence_and_changes_nothing(order, reason):
    arrivals = fly(EmulatedLaboratory(scenario(), seed=3), orders={50: order})
    ((stamp_ns, refused),) = events(arrivals)
    assert stamp_ns == S + 1
    assert isinstance(refused, FailureRefused)
    with pytest.raises(ValueError, match=reason):
        raise ValueError(refused.reason)
    assert others(arrivals) == others(fly(EmulatedLaboratory(scenario(), seed=3)))


class Line:
    """A client of the laboratory's channel that reads line by line."""

    def __init__(self, address):
        host, port = str(address).removeprefix("socket://").split(":")
        self.socket = socket.create_connection((host, int(port)), 5.0)
        self.file = self.socket.makefile("rwb")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()
        self.socket.close()

    def send(self, line):
        self.file.write(line)
        self.file.flush()

    def event(self):
        return parse_event(self.file.readline())


def test_live_a_line_injects_a_failure_and_every_client_learns_of_it(serving):
    order = InjectOrder("stuck_open_valve", "beta", {"valve": 3}, for_s=0.2)
    with serving(scenario()) as addresses, Line(addresses["laboratory"]) as one:
        with Line(addresses["laboratory"]) as other:
            one.send(encode_order(InjectOrder("dead_sky", "alpha", for_s=0.05)))
            assert [other.event().is_active for _ in range(2)] == [True, False]  # it is connected
            one.send(encode_order(order))
            event = FailureEvent("stuck_open_valve", "beta", {"valve": 3.0}, is_active=True)
            assert other.event() == event
            assert other.event() == replace(event, is_active=False)
        assert [one.event().kind for _ in range(4)] == ["dead_sky"] * 2 + ["stuck_open_valve"] * 2


def test_live_a_late_client_learns_what_is_active(serving):
    rows = [
        {"kind": "dead_sky", "vehicle": "alpha"},
        {"kind": "stuck_gyro", "vehicle": "beta", "end_s": 1e-3},
    ]
    with serving(scenario(failures=rows)) as addresses:
        with Line(addresses["laboratory"]) as first:
            first.send(encode_order(InjectOrder("dead_sky", "beta")))
            while first.event() != FailureEvent("dead_sky", "beta", {}, is_active=True):
                pass
        with Line(addresses["laboratory"]) as late:
            late.send(b"nonsense\n")
            assert late.event() == FailureEvent("dead_sky", "alpha", {}, is_active=True)
            assert late.event() == FailureEvent("dead_sky", "beta", {}, is_active=True)
            assert isinstance(late.event(), FailureRefused)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"hello\n", "no JSON"),
        (b"\xff\xfe\n", "no JSON"),
        (
            json.dumps({"inject": "gremlin", "vehicle": "alpha"}).encode() + b"\n",
            "no failure of kind 'gremlin'",
        ),
        (b'{"inject": "leaking_valve", "vehicle": "alpha", "parameters": {"fraction": NaN}}\n', "NaN"),
        (b'{"inject": "leaking_valve", "vehicle": "alpha", "parameters": {"valve": 1.5}}\n', "whole number"),
        (b"x" * 5000, "longer than 4096 bytes"),
    ],
)
def test_live_a_wrong_line_is_answered_with_its_reason(serving, line, reason):
    with serving(scenario()) as addresses, Line(addresses["laboratory"]) as client:
        client.send(line)
        refused = client.event()
        assert isinstance(refused, FailureRefused)
        assert reason in refused.reason
