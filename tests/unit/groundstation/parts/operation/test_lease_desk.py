"""Control of the rig: taken, extended, handed over, expired; and who may ask for what meanwhile."""

import json

import pytest

from groundstation.declarations.lease import FREE_FOR_ALL, Lease, LeaseCheck
from groundstation.declarations.request import Ack, Request
from groundstation.parts.laboratory.failure_desk import FailureDesk
from groundstation.parts.operation.lease_desk import LeaseDesk
from groundstation.parts.operation.lease_memory import LeasePort, text_of
from groundstation.parts.operation.messages import KeptLease
from groundstation.parts.table import own_tables

S = 1_000_000_000


class Desk:
    """A desk, and what it answered."""

    def __init__(self):
        self.node = LeaseDesk(("alpha",))
        self.check = LeaseCheck()
        self.lease = None

    def recall(self, t_s, content):
        self._take(self.node.receive(KeptLease(t_s * S, "", content), t_s * S))

    def _take(self, made):
        reason = None
        for message in made:
            if isinstance(message, Lease):
                self.lease = message
                self.check.take(message)
            elif isinstance(message, Ack):
                assert message.accepted is not bool(message.reason)
                reason = message.reason
        return reason

    def ask(self, t_s, author, action, **arguments):
        request = Request(t_s * S, "alpha", 1, author, action, json.dumps(arguments))
        return self._take(self.node.receive(request, t_s * S))

    def objection(self, t_s, author, action):
        return self.check.objection(Request(0, "alpha", 1, author, action, "{}"), t_s * S)


@pytest.fixture
def desk():
    return Desk()


def test_while_nobody_holds_control_anyone_may_ask(desk):
    assert desk.lease is None
    assert desk.objection(1, "bob", "go_to") == ""
    desk.recall(1, "")
    assert desk.lease.holder == ""
    assert desk.objection(1, "bob", "go_to") == ""
    assert LeaseCheck().objection(Request(0, "alpha", 1, "bob", "go_to", "{}"), 0) == ""


def test_others_are_refused_with_who_and_how_long(desk):
    assert desk.ask(10, "anna", "take_control", for_s=3600.0) == ""
    assert desk.objection(10, "bob", "go_to") == (
        "control is held by anna for another 1:00:00; ask for it with take_control"
    )
    assert "0:00:01" in desk.objection(3609, "bob", "fly")
    assert desk.objection(3610, "bob", "fly") == "", "it has expired"
    assert desk.objection(11, "anna", "fly") == ""


def test_anyone_may_take_motion_away(desk):
    desk.ask(10, "anna", "take_control")
    assert {"stop", "land", "disarm", "float_off", "brake"} == FREE_FOR_ALL
    assert [desk.objection(11, "bob", action) for action in FREE_FOR_ALL] == [""] * 5
    known = own_tables().actions
    assert set(known) >= FREE_FOR_ALL


def test_control_cannot_be_taken_from_its_holder_even_by_force(desk):
    desk.ask(10, "anna", "take_control", for_s=60.0)
    assert desk.ask(20, "bob", "take_control") == (
        "control is held by anna for another 0:00:50: ask anna to give_control"
    )
    assert "cannot be forced before" in desk.ask(69, "bob", "take_control", force="I am in a hurry")
    assert desk.lease.holder == "anna"


def test_what_has_expired_is_taken_with_a_reason_which_is_published(desk):
    desk.ask(10, "anna", "take_control", for_s=60.0)
    assert desk.ask(70, "bob", "take_control", force=" ") == (
        "anna has not given control back: take it with force=REASON"
    )
    assert desk.ask(70, "bob", "take_control", for_s=5.0, force="she went home") == ""
    assert (desk.lease.holder, desk.lease.expires_ns, desk.lease.reason) == ("bob", 75 * S, "she went home")


def test_the_holder_extends_and_no_reason_is_kept(desk):
    desk.ask(10, "anna", "take_control", for_s=60.0, force="just so")
    assert desk.lease.reason == ""
    assert desk.ask(100, "anna", "take_control", for_s=60.0) == ""
    assert desk.lease.expires_ns == 160 * S


def test_control_is_given_back_and_handed_over(desk):
    desk.ask(10, "anna", "take_control", for_s=60.0)
    assert desk.ask(20, "bob", "give_control") == "control is held by anna"
    assert desk.ask(20, "anna", "give_control", to="bob") == ""
    assert (desk.lease.holder, desk.lease.expires_ns) == ("bob", 70 * S)
    assert desk.ask(30, "bob", "give_control") == ""
    assert desk.lease.holder == ""
    assert desk.ask(31, "bob", "give_control") == "control is held by nobody"
    assert desk.ask(32, "carl", "take_control") == ""


def test_an_expired_lease_cannot_be_handed_on_but_given_back(desk):
    desk.ask(10, "anna", "take_control", for_s=60.0)
    assert desk.ask(70, "anna", "give_control", to="bob") == "your lease has expired: take_control first"
    assert desk.ask(70, "anna", "give_control") == ""


@pytest.mark.parametrize(
    ("author", "arguments", "reason"),
    [
        ("anna", {"for_s": 3601.0}, "for_s is 3601, expected 1 to 3600"),
        ("anna", {"for_s": "long"}, "expected a number"),
        ("anna", {"with": 1}, "take_control has no argument 'with'"),
        ("", {}, "take_control needs a name"),
    ],
)
def test_what_cannot_be_granted_is_refused(desk, author, arguments, reason):
    assert reason in desk.ask(10, author, "take_control", **arguments)
    assert desk.lease is None


def test_other_requests_are_not_the_desks(desk):
    assert desk.ask(10, "anna", "fly") is None


def test_all_who_answer_ask_first():
    """Whoever answers an action that sets something in motion takes the lease."""
    tables = own_tables()
    answering = {row.answered_by for row in tables.actions.values()} - {"lease_desk", "star_tracker"}
    for name in answering & {"supervisor", "controller", "command_mux", "failure_desk"}:
        assert Lease in tables.nodes[name].node_class().inputs, name
    assert {"supervisor", "controller", "command_mux", "failure_desk"} <= answering


def test_a_failure_is_not_injected_for_somebody_who_does_not_hold_control():
    desk = FailureDesk(("alpha",))
    list(desk.receive(Lease(0, "", "anna", 60 * S, ""), 0))
    arguments = json.dumps({"failure": "dead_sky", "for_s": 1.0})
    (ack,) = desk.receive(Request(S, "alpha", 1, "bob", "inject", arguments), S)
    assert ack.reason.startswith("control is held by anna for another 0:00:59")
    (order,) = desk.receive(Request(S, "alpha", 1, "anna", "inject", arguments), S)
    assert order.failure == "dead_sky"


def test_a_lease_outlives_the_process_that_granted_it(desk):
    assert desk.ask(10, "anna", "take_control", for_s=600.0) == ""
    another = Desk()
    another.recall(20, text_of(desk.lease))
    assert another.lease.holder == "anna"
    assert another.objection(20, "bob", "go_to") == desk.objection(20, "bob", "go_to")
    assert "give_control" in another.ask(21, "bob", "take_control")
    assert another.ask(22, "anna", "give_control", to="bob") == ""
    assert another.objection(23, "bob", "go_to") == ""


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[" * 100_000,
        "[]",
        "null",
        '{"holder": "anna"}',
        '{"stamp_ns": "soon", "holder": "anna", "expires_ns": 5, "reason": ""}',
        '{"stamp_ns": 1e400, "holder": "anna", "expires_ns": 5, "reason": ""}',
        text_of(Lease(900 * S, "", "anna", 1500 * S, "")),  # granted before the host was started again
        text_of(Lease(100 * S, "", "anna", 9000 * S, "")),
        text_of(Lease(-S, "", "anna", 200 * S, "")),
    ],
)
def test_what_cannot_be_a_lease_of_now_is_nobodys(desk, content):
    desk.recall(100, content)
    assert desk.lease.holder == ""
    assert desk.objection(101, "bob", "go_to") == ""


def test_the_port_keeps_the_lease_and_reads_it_again(tmp_path):
    lease = Lease(7, "", "anna", 99 * S, "asleep")
    port = LeasePort("lease", "", f"{tmp_path}?expected")
    edge = port.open()
    ((_, data),) = edge.read()
    assert port.to_message(5, data).content == ""
    edge.write(port.to_device(lease))
    edge.close()
    edge = port.open()
    ((stamp_ns, data),) = edge.read()
    edge.close()
    message = port.to_message(stamp_ns, data)
    assert message.content == text_of(lease)
    assert port.writes() == ((Lease, ""),)
