"""A program outside in virtual time: it flies, falls silent, is braked for, comes back, loses the vehicle."""

import json
import math

import pytest

from groundstation.declarations.lease import Lease
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Request
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.outside.messages import OutsideAnswer, OutsideText, OutsideWrench
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.valves.messages import OutsideControl, ValveDemand, ValveSelection
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder
from groundstation.rig.plan import make_node
from groundstation.runners.replay import ReplayRunner

S = 1_000_000_000
PERIOD_NS = 50_000_000


class Program(Node):
    """Pushes along table x by texts, as a program outside does, in given spans of time.

    Args:
        spans: Begin and end in seconds.
        force_n: What it wants along body x.
    """

    inputs = (VehicleState,)
    outputs = (OutsideText,)

    def __init__(self, spans, force_n=0.03, asks=()):
        super().__init__("", PERIOD_NS)
        self._spans, self._force_n, self._asks = spans, force_n, list(asks)
        self._number = 0

    def sources(self, payload):
        return ("alpha",)

    def receive(self, message, now_ns):
        return ()

    def tick(self, now_ns):
        now_s = now_ns / S
        while self._asks and self._asks[0][0] <= now_s:
            _, action, arguments = self._asks.pop(0)
            yield self._text(now_ns, "request", action=action, arguments=arguments)
        if any(begin <= now_s < end for begin, end in self._spans):
            yield self._text(now_ns, "wrench", force_x_n=self._force_n, force_y_n=0.0, torque_nm=0.0)

    def _text(self, now_ns, noun, **content):
        self._number += 1
        text = json.dumps({"author": "anna", "id": self._number, **content}).encode()
        return OutsideText(now_ns, "", f"outside/alpha/{noun}", text, 0)


TAKE = (4.0, "take_control", {"for_s": 600.0})


def sources(flight, start_s):
    """The sources of commands, each once for as long as it lasts."""
    found = []
    for selection in flight.of(ValveSelection, start_s=start_s):
        if not found or found[-1] != selection.source:
            found.append(selection.source)
    return found


@pytest.mark.provokes("outside_silent")
def test_it_flies_and_its_silence_is_a_fault_that_ends_when_it_is_back(fly):
    flight = fly(extra_nodes=[Program([(6.0, 8.0), (14.0, 15.0)], asks=[TAKE])]).run(20.0)
    assert sources(flight, 5.9)[:3] == ["controller", "outside", "brake"]
    assert flight.faults(start_s=7.9) == {"outside_silent"}
    speeds = [math.hypot(*s.velocity_table_m_s) for s in flight.of(VehicleState, start_s=7.0, stop_s=8.0)]
    assert max(speeds) > 0.004  # 0.03 N for a second and more on 11 kg
    braked = flight.of(ValveSelection, start_s=8.0)
    silent_ns = (
        next(each.stamp_ns for each in braked if each.source == "brake")
        - flight.of(OutsideWrench, stop_s=9.0)[-1].stamp_ns
    )
    assert 0.24 * S < silent_ns <= 0.26 * S
    held = [math.hypot(*s.velocity_table_m_s) for s in flight.of(ReferenceState, start_s=13.0, stop_s=14.0)]
    assert max(held) < 0.006
    assert flight.modes(start_s=5.9)[:3] == ["flying", "braking", "holding"]
    assert "flying" in flight.modes(start_s=14.0)  # it came back for a second, and the fault ended
    assert flight.modes(start_s=16.5)[-1] in ("braking", "holding")


def test_resume_gives_the_vehicle_back(fly):
    flight = fly(extra_nodes=[Program([(6.0, 7.0)], asks=[TAKE])]).run(9.0)
    flight.request("resume", author="anna", request_id=9)
    flight.run(12.0)
    assert sources(flight, 20.0) == ["controller"]
    assert flight.of(OutsideControl)[-1].reason == "resumed by anna"
    assert flight.off_goal(start_s=20.5)[0].max() < 0.02
    assert flight.faults(start_s=12.0) == set()


def test_without_the_lease_nothing_happens_and_the_program_is_told_why(fly):
    flight = fly(extra_nodes=[Program([(5.0, 7.5)])]).run(8.0)
    assert set(sources(flight, 4.9)) == {"controller"}
    answers = [json.loads(answer.content) for answer in flight.published[OutsideAnswer]]
    assert [answer["action"] for answer in answers] == ["wrench"] * 3  # once a second
    assert {answer["reason"] for answer in answers} == {"nobody holds control: ask for it with take_control"}


def test_goals_from_outside_are_answered(fly):
    goal = {"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0}
    asks = [(4.0, "go_to", goal), (4.5, "go_to", {"x_m": 99.0}), (5.0, "take_control", {}), (5.5, "fire", {})]
    flight = fly(extra_nodes=[Program([], asks=asks)]).run(7.0)
    answers = [json.loads(answer.content) for answer in flight.published[OutsideAnswer]]
    assert [(answer["id"], answer["action"], answer["accepted"]) for answer in answers] == [
        (1, "go_to", True), (2, "go_to", False), (3, "take_control", True), (4, "fire", False),
    ]  # fmt: skip
    assert all(answer["accepted"] or len(answer["reason"].split()) > 2 for answer in answers)
    assert flight.published[Lease][-1].holder == "anna"
    assert len(flight.published[Ack]) == len(flight.published[Request]) == 4


@pytest.mark.parametrize("force_n", [1000.0, -1000.0])
def test_it_cannot_push_the_vehicle_off_the_table(fly, force_n):
    flight = fly(extra_nodes=[Program([(5.0, 40.0)], force_n=force_n, asks=[TAKE])]).run(40.0)
    assert "outside" in sources(flight, 5.0)
    rows = flight.of(ReferenceState, start_s=5.0)
    assert max(abs(row.position_table_m[0]) for row in rows) < 2.0
    assert max(abs(row.position_table_m[1]) for row in rows) < 1.5
    assert any(demand.limited_by for demand in flight.of(ValveDemand, start_s=5.0))
    assert flight.modes(start_s=5.0)[-1] in ("flying", "braking", "holding")


def test_a_recording_of_it_replays_bit_for_bit(fly, tmp_path):
    path = tmp_path / "outside.mcap"
    flight = fly(extra_nodes=[Program([(6.0, 7.0)], asks=[TAKE])])
    with Recorder(path, RecordingInfo()) as recorder:
        flight.runner._observers += (recorder.record,)
        flight.run(9.0)
    with Recording(path) as recording:
        controls = [row.payload for row in recording.messages((OutsideControl,))]
        keys = ("outside_desk", "alpha/command_mux", "alpha/supervisor")
        report = ReplayRunner(recording, lambda key: make_node(flight.rig, key), keys).run()
    assert [(each.author, each.is_silent) for each in controls] == [("anna", False), ("anna", True)]
    assert set(report.nodes) == set(keys)
    assert report.agrees
    assert not report.missing_inputs
