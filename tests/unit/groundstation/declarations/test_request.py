"""Arguments of actions: taken by name, checked once, refused in a sentence."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.declarations.request import (
    Ack,
    Action,
    Argument,
    ArgumentError,
    Request,
    answer,
    checked_name,
    shown_name,
    table_of,
)

TURN = Action(
    "turn",
    "controller",
    "turn on the spot",
    (
        Argument("heading_rad", "where to", low=-math.pi, high=math.pi),
        Argument("rounds", "how often", int, low=0, high=9, default=1),
        Argument("note", "for people", str, default=""),
        Argument("slowly", "or not", bool, default=False),
    ),
)
NOTHING = Action("halt", "controller", "stand still")


SAY = Action("say", "speaker", "say something", (Argument("words", kind=str),))


def asked(arguments):
    return Request(5, "alpha", 7, "operator", "turn", arguments)


def refusal(action, given):
    with pytest.raises(ArgumentError) as refused:
        action.check(given)
    assert "\n" not in str(refused.value)
    return str(refused.value)


LINES = st.text(st.characters(exclude_categories=("C", "Z"), include_characters=" "), max_size=500)


@given(
    st.fixed_dictionaries(
        {"heading_rad": st.floats(-math.pi, math.pi)},
        optional={"rounds": st.integers(0, 9), "note": LINES, "slowly": st.booleans()},
    )
)
def test_what_was_asked_for_comes_back_complete(given):
    values = TURN.read(asked(json.dumps(given)))
    assert values == {"rounds": 1, "note": "", "slowly": False} | given
    assert list(values) == ["heading_rad", "rounds", "note", "slowly"]


@given(st.text(max_size=60) | st.binary(max_size=60).map(lambda data: data.decode("latin1")))
def test_any_text_is_read_or_refused(text):
    refused = None
    try:
        values = TURN.read(asked(text))
    except ArgumentError as error:
        refused = str(error)
    assert refused.startswith("turn") if refused is not None else math.isfinite(values["heading_rad"])


def test_a_whole_number_is_a_number():
    values = TURN.check({"heading_rad": 1})
    assert values["heading_rad"] == 1.0
    assert isinstance(values["heading_rad"], float)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({}, "turn needs heading_rad: it takes heading_rad, rounds, note, slowly"),
        ({"heading": 1.0}, "turn has no argument 'heading': it takes heading_rad, rounds, note, slowly"),
        ({"heading_rad": "north"}, "turn: heading_rad is 'north', expected a number"),
        ({"heading_rad": None}, "turn: heading_rad is None, expected a number"),
        ({"heading_rad": True}, "turn: heading_rad is True, expected a number"),
        ({"heading_rad": math.nan}, "turn: heading_rad is nan, expected a finite number"),
        ({"heading_rad": math.inf}, "turn: heading_rad is inf, expected a finite number"),
        ({"heading_rad": 10**400}, "turn: heading_rad is inf, expected a finite number"),
        ({"heading_rad": 4.0}, "turn: heading_rad is 4, expected -3.14159 to 3.14159"),
        ({"heading_rad": 0.0, "rounds": 1.5}, "turn: rounds is 1.5, expected a value of type int"),
        ({"heading_rad": 0.0, "rounds": 10}, "turn: rounds is 10, expected 0 to 9"),
        ({"heading_rad": 0.0, "rounds": False}, "turn: rounds is False, expected a value of type int"),
        ({"heading_rad": 0.0, "note": 5}, "turn: note is 5, expected a value of type str"),
        ({"heading_rad": 0.0, "slowly": 1}, "turn: slowly is 1, expected a value of type bool"),
    ],
)
def test_what_cannot_be_understood_is_refused_by_its_name(given, sentence):
    assert refusal(TURN, given) == sentence


def test_a_huge_whole_number_is_refused_as_short_as_a_small_one():
    sentence = refusal(TURN, {"heading_rad": 0.0, "rounds": 10**400})
    assert sentence.startswith("turn: rounds is ")
    assert len(sentence) < 120


def test_a_long_value_is_shown_shortened():
    sentence = refusal(TURN, {"heading_rad": "north" * 1000})
    assert "..." in sentence
    assert len(sentence) < 120


def test_an_action_without_arguments_takes_none():
    assert NOTHING.read(asked("")) == NOTHING.read(asked("{}")) == {}
    assert refusal(NOTHING, {"now": True}) == "halt has no argument 'now': it takes no arguments"


@pytest.mark.parametrize("text", ["{", "[]", "3", "null", "'heading_rad'", "[" * 10_000])
def test_what_is_no_json_object_is_refused(text):
    with pytest.raises(ArgumentError, match=r"^turn: the arguments are no JSON object$"):
        TURN.read(asked(text))


WILD_TEXTS = ["a\nb", "\x1b[2J", "\x00", "\r", "\udcff", "\u2028", "x" * 501, "y" * 100_000]


@pytest.mark.parametrize("text", WILD_TEXTS)
def test_a_text_that_is_no_line_for_people_is_refused_and_not_repeated(text):
    sentence = refusal(SAY, {"words": text})
    assert sentence.startswith("say: words is ")
    assert sentence.isprintable()
    assert len(sentence) < 120
    with pytest.raises(ArgumentError, match="the name of who asks is "):
        checked_name(text)
    with pytest.raises(ArgumentError, match="the name of who asks is "):
        TURN.read(Request(5, "alpha", 7, text, "turn", '{"heading_rad": 1.0}'))
    shown = shown_name(text)
    assert shown.isprintable()
    assert 0 < len(shown) <= 64


@pytest.mark.parametrize("text", ["", "Anna Müller", "王", "x" * 64])
def test_a_name_that_can_be_shown_stays_as_it_is(text):
    assert checked_name(text) == text
    assert shown_name(text) == (text or "somebody")
    assert SAY.check({"words": text}) == {"words": text}


def test_an_answer_names_what_was_asked_and_by_whom():
    done, refused = answer(asked(""), 9), answer(asked(""), 9, "not now")
    assert isinstance(done, Ack)
    for ack in (done, refused):
        named = (ack.stamp_ns, ack.vehicle, ack.request_id, ack.author, ack.action)
        assert named == (9, "alpha", 7, "operator", "turn")
    assert (done.accepted, done.reason) == (True, "")
    assert (refused.accepted, refused.reason) == (False, "not now")


def test_actions_are_found_by_their_names():
    assert table_of(TURN, NOTHING) == {"turn": TURN, "halt": NOTHING}
