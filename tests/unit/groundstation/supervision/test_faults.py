"""A row of the table of faults, and the board of those that stand."""

import pytest

from groundstation.supervision.fault_board import FaultBoard, Standing
from groundstation.supervision.faults import CLEAR_S, Clears, Fault, Response

S = 1_000_000_000
CLEAR_NS = round(CLEAR_S * S)


def fault(name, *steps, clears=Clears.ITSELF, confirm_s=0.0):
    return Fault(name, "What.", "how", 1.0, steps, clears, True, False, "Do.", confirm_s=confirm_s)


TABLE = {
    row.id: row
    for row in (
        fault("note", (0.0, Response.NOTE)),
        fault("hold", (0.0, Response.HOLD)),
        fault("also_hold", (0.0, Response.HOLD)),
        fault("grows", (0.0, Response.NOTE), (2.0, Response.LAND), (3.0, Response.CUT)),
        fault("slow", (0.0, Response.HOLD), confirm_s=0.5),
        fault("latched", (0.0, Response.CUT), clears=Clears.PERSON),
    )
}


@pytest.fixture
def board():
    return FaultBoard(TABLE)


def ids(board):
    return [row.fault.id for row in board]


@pytest.mark.parametrize(
    ("age_s", "due"),
    [(0.0, "NOTE"), (1.99, "NOTE"), (2.0, "LAND"), (2.99, "LAND"), (3.0, "CUT"), (1e9, "CUT")],
)
def test_a_response_degrades_in_steps(age_s, due):
    assert TABLE["grows"].response(age_s) is Response[due]


def test_a_fault_whose_first_step_is_late_still_has_it_at_once():
    assert fault("late", (1.0, Response.HOLD)).response(0.0) is Response.HOLD


def test_responses_are_ordered_by_strength_and_have_words():
    assert Response.NOTE < Response.HOLD < Response.LAND < Response.CUT
    words = [response.words for response in Response]
    assert words == ["flies on", "brakes and holds", "brakes, then lands", "cuts the float air"]


def test_a_vehicle_without_faults_has_nothing_due(board):
    assert not board.look(0, {})
    assert not ids(board)
    assert board.worst() is None
    assert not board.clear()


def test_a_fault_that_begins_stands_with_what_was_found(board):
    assert board.look(5, {"hold": "why"})
    (row,) = board
    assert row == Standing(TABLE["hold"], "why", 5, 5, is_there=True)
    assert "hold" in board
    assert "note" not in board
    assert not board.look(6, {"hold": "other numbers"})
    assert (row.detail, row.since_ns, row.seen_ns) == ("why", 5, 6)


def test_a_fault_that_the_table_does_not_know_is_an_error(board):
    with pytest.raises(KeyError):
        board.look(0, {"unknown": ""})


def test_a_fault_ends_by_itself_once_it_was_not_seen_for_a_second(board):
    board.look(0, {"hold": ""})
    board.look(10, {"hold": ""})
    assert not board.look(10 + CLEAR_NS - 1, {})
    assert ids(board) == ["hold"]
    assert board.look(10 + CLEAR_NS, {})
    assert not ids(board)


def test_a_fault_that_flickers_is_one_fault(board):
    board.look(0, {"grows": ""})
    assert not board.look(S // 2, {})
    assert not board.look(S, {"grows": ""})
    assert board.look(2 * S, {"grows": ""})
    assert next(iter(board)).response is Response.LAND


def test_a_step_of_the_response_is_a_change(board):
    board.look(5 * S, {"grows": ""})
    changes = [half for half in range(1, 9) if board.look(5 * S + half * S // 2, {"grows": ""})]
    assert changes == [4, 6]


def test_a_response_does_not_grow_while_the_fault_is_not_seen(board):
    board.look(0, {"grows": ""})
    board.look(2 * S - 1, {"grows": ""})
    assert not board.look(2 * S + 1, {})
    assert next(iter(board)).response is Response.NOTE


def test_what_has_to_be_confirmed_must_be_seen_without_a_break(board):
    assert not board.look(0, {"slow": "first"})
    assert not board.look(S // 2 - 1, {"slow": ""})
    board.look(S // 2, {})
    assert not board.look(S, {"slow": ""})
    assert not board.look(3 * S // 2 - 1, {"slow": ""})
    assert board.look(3 * S // 2, {"slow": "now"})
    (row,) = board
    assert (row.detail, row.since_ns) == ("now", 3 * S // 2)


def test_a_fault_that_is_seen_all_the_time_never_ends(board):
    board.look(0, {"hold": ""})
    assert not board.look(3 * CLEAR_NS, {"hold": ""})
    assert ids(board) == ["hold"]


def test_a_latched_fault_that_is_gone_stands_but_asks_for_nothing(board):
    board.look(0, {"latched": "first"})
    assert board.worst().fault.id == "latched"
    assert board.look(CLEAR_NS, {})
    (row,) = board
    assert not row.is_there
    assert row.response is Response.NOTE
    assert board.worst() is None
    assert not board.look(2 * CLEAR_NS, {})


def test_a_latched_fault_that_comes_back_begins_again(board):
    board.look(0, {"latched": "first"})
    board.look(CLEAR_NS, {})
    assert board.look(2 * CLEAR_NS, {"latched": "second"})
    (row,) = board
    assert (row.detail, row.since_ns, row.seen_ns, row.is_there) == (
        "second", 2 * CLEAR_NS, 2 * CLEAR_NS, True,
    )  # fmt: skip
    assert board.worst() is row
    assert not board.look(3 * CLEAR_NS - 1, {})


def test_several_faults_end_each_in_its_own_time(board):
    board.look(0, {"hold": "", "latched": "", "note": ""})
    assert board.look(CLEAR_NS, {"note": ""})
    assert ids(board) == ["latched", "note"]
    board.look(2 * CLEAR_NS, {"note": "", "hold": ""})
    board.look(3 * CLEAR_NS, {"note": ""})
    assert ids(board) == ["latched", "note"]


def test_a_fault_ends_behind_one_that_goes_on(board):
    board.look(0, {"note": "", "hold": ""})
    board.look(CLEAR_NS, {"note": ""})
    assert ids(board) == ["note"]


def test_a_person_clears_what_is_gone_and_nothing_else(board):
    board.look(0, {"latched": "", "hold": ""})
    assert not board.clear()
    board.look(CLEAR_NS, {"hold": ""})
    assert board.clear()
    assert ids(board) == ["hold"]


def test_the_strongest_response_counts_and_the_oldest_of_equals(board):
    found = {"note": "", "hold": "", "also_hold": "", "grows": ""}
    board.look(0, found)
    assert board.worst().fault.id == "hold"
    board.look(2 * S - 1, found)
    assert board.worst().fault.id == "hold"
    board.look(2 * S, found)
    assert board.worst().fault.id == "grows"


def test_the_board_of_a_vehicle_knows_the_whole_table():
    assert FaultBoard().look(0, {"tank_low": "20 bar"})
