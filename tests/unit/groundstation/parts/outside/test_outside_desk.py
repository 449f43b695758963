"""The desk for programs outside: texts become wrenches and requests, answers find their way back."""

import json

import pytest

from groundstation.declarations.request import Ack, Request
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.outside.messages import OutsideAnswer, OutsideText, OutsideWrench
from groundstation.parts.outside.outside_desk import MOST_ASKED, OutsideDesk

ANNA = {"author": "anna", "id": 7}
WRENCH = ANNA | {"force_x_n": 0.05, "force_y_n": 0.01, "torque_nm": 0.002}
GO_TO = ANNA | {"action": "go_to", "arguments": {"x_m": 0.2}}


@pytest.fixture
def desk():
    return OutsideDesk(("alpha", "beta"))


def give(desk, key, content, now_ns=50, replaced=0):
    content = content if isinstance(content, bytes) else json.dumps(content).encode()
    return list(desk.receive(OutsideText(40, "", key, content, replaced), now_ns))


def counts(desk):
    found = list(desk.tick(10**9))
    return {name: int(value) for each in found for name, value in zip(each.keys, each.values, strict=True)}


def test_a_wrench_becomes_one_with_the_stamp_of_its_arrival(desk):
    [wrench] = give(desk, "outside/beta/wrench", WRENCH)
    assert isinstance(wrench, OutsideWrench)
    assert (wrench.stamp_ns, wrench.vehicle, wrench.author, wrench.wrench_id) == (40, "beta", "anna", 7)
    assert (wrench.force_body_n, wrench.torque_nm) == ((0.05, 0.01), 0.002)


def test_a_request_is_made_in_its_authors_name_and_its_answer_goes_back_once(desk):
    [request] = give(desk, "outside/alpha/request", GO_TO)
    assert isinstance(request, Request)
    assert (request.vehicle, request.request_id, request.author, request.action) == (
        "alpha",
        7,
        "anna",
        "go_to",
    )
    assert json.loads(request.arguments) == {"x_m": 0.2}
    ack = Ack(60, "alpha", 7, "anna", "go_to", False, "not there")
    [answer] = desk.receive(ack, 70)
    assert isinstance(answer, OutsideAnswer)
    assert answer.key == "outside/alpha/answer"
    assert json.loads(answer.content) == ANNA | {"action": "go_to", "accepted": False, "reason": "not there"}
    assert list(desk.receive(ack, 80)) == []


def test_answers_to_others_do_not_leave_the_station(desk):
    give(desk, "outside/alpha/request", GO_TO)
    for vehicle, author, number in (("beta", "anna", 7), ("alpha", "otto", 7), ("alpha", "anna", 8)):
        assert list(desk.receive(Ack(60, vehicle, number, author, "go_to", True, ""), 70)) == []


def test_what_becomes_of_wrenches_always_goes_back(desk):
    [answer] = desk.receive(Ack(60, "alpha", 9, "anna", "wrench", True, ""), 70)
    assert json.loads(answer.content)["id"] == 9


def test_requests_that_nobody_answers_are_forgotten_in_the_end(desk):
    for number in range(MOST_ASKED + 1):
        give(desk, "outside/alpha/request", GO_TO | {"id": number})
    assert list(desk.receive(Ack(60, "alpha", 0, "anna", "go_to", True, ""), 70)) == []
    assert len(list(desk.receive(Ack(60, "alpha", 1, "anna", "go_to", True, ""), 70))) == 1


def test_garbage_is_counted_by_its_reason_and_the_last_one_is_quoted(desk):
    for content in (b"?", b"[]", WRENCH | {"torque_nm": 1e308}, WRENCH | {"id": "7"}, ANNA, b"x" * 5000):
        assert give(desk, "outside/alpha/wrench", content) == []
    assert give(desk, "outside/gamma/wrench", WRENCH) == []
    give(desk, "outside/alpha/wrench", WRENCH, replaced=3)
    [report] = desk.tick(10**9)
    assert isinstance(report, Diagnostics)
    assert report.summary == "outside/gamma/wrench: there is no vehicle 'gamma' (there are alpha, beta)"
    assert report.level == 1
    assert dict(zip(report.keys, report.values, strict=True)) == {
        "taken": "1", "replaced": "3", "too_long": "1", "no_json_object": "2", "key_missing": "1",
        "wrong_type": "1", "out_of_range": "1", "no_such_vehicle": "1",
    }  # fmt: skip


def test_it_reports_only_what_has_changed(desk):
    assert counts(desk) == {}
    give(desk, "outside/alpha/wrench", b"?")
    assert counts(desk)["no_json_object"] == 1
    assert counts(desk) == {}
    give(desk, "outside/alpha/wrench", WRENCH)
    [report] = desk.tick(10**9)
    assert (report.level, report.summary) == (0, "")
