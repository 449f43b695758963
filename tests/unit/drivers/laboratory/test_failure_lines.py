import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.laboratory import (
    FailureEvent,
    FailureRefused,
    InjectOrder,
    encode_event,
    encode_order,
    parse_event,
    parse_order,
)

TEXTS = st.text(st.characters(exclude_categories=["Cs"]))
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
PARAMETERS = st.dictionaries(TEXTS, NUMBERS)


def test_lines_are_as_documented():
    order = InjectOrder("stuck_open_valve", "alpha", {"valve": 3.0}, for_s=10.0)
    assert encode_order(order) == (
        b'{"inject": "stuck_open_valve", "vehicle": "alpha", "parameters": {"valve": 3.0}, "for_s": 10.0}\n'
    )
    event = FailureEvent("stuck_open_valve", "alpha", {"valve": 3.0}, is_active=True)
    assert encode_event(event) == (
        b'{"failure": "stuck_open_valve", "vehicle": "alpha", "parameters": {"valve": 3.0}, '
        b'"is_active": true}\n'
    )
    assert encode_event(FailureRefused("no")) == b'{"refused": "no"}\n'


@given(TEXTS, TEXTS, PARAMETERS, st.booleans())
def test_an_event_survives_its_line(kind, vehicle, parameters, is_active):
    event = FailureEvent(kind, vehicle, parameters, is_active)
    line = encode_event(event)
    assert line.count(b"\n") == 1
    assert parse_event(line) == event


@given(TEXTS, TEXTS, PARAMETERS, NUMBERS)
def test_an_order_survives_its_line(kind, vehicle, parameters, for_s):
    order = InjectOrder(kind, vehicle, parameters, for_s)
    assert parse_order(encode_order(order)) == order


@given(TEXTS)
def test_a_refusal_survives_its_line(reason):
    assert parse_event(encode_event(FailureRefused(reason))) == FailureRefused(reason)


def test_what_json_cannot_say_is_null():
    line = encode_order(InjectOrder("stuck_gyro", "alpha", {"code": math.nan}))
    assert b"null" in line
    order = parse_order(line)
    assert math.isnan(order.parameters["code"])
    assert order.for_s == math.inf


def test_parameters_and_duration_may_be_left_out():
    assert parse_order('{"inject": "dead_sky", "vehicle": "alpha"}') == InjectOrder("dead_sky", "alpha")


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("", "no JSON"),
        ("[1]", "no JSON object but a list"),
        ("[" * 100_000, "nested too deeply"),
        ('{"vehicle": "alpha"}', "lacks the key 'inject'"),
        ('{"inject": "x"}', "lacks the key 'vehicle'"),
        ('{"inject": "x", "vehicle": "a", "valve": 1}', "unknown key 'valve'"),
        ('{"inject": 1, "vehicle": "a"}', "inject must be a text"),
        ('{"inject": "x", "vehicle": null}', "vehicle must be a text"),
        ('{"inject": "x", "vehicle": "a", "parameters": [1]}', "parameters must be an object"),
        ('{"inject": "x", "vehicle": "a", "parameters": {"p": "1"}}', "parameter p must be a number"),
        ('{"inject": "x", "vehicle": "a", "parameters": {"p": true}}', "parameter p must be a number"),
        ('{"inject": "x", "vehicle": "a", "parameters": {"p": NaN}}', "NaN is not a number"),
        ('{"inject": "x", "vehicle": "a", "for_s": Infinity}', "Infinity is not a number"),
        ('{"inject": "x", "vehicle": "a", "for_s": 1e999}', "for_s is too large"),
        ('{"inject": "x", "vehicle": "a", "for_s": 1' + "0" * 400 + "}", "for_s is too large"),
        ('{"inject": "x", "vehicle": "a", "for_s": "10"}', "for_s must be a number"),
    ],
)
def test_a_wrong_order_is_refused_in_a_sentence(line, complaint):
    with pytest.raises(ValueError, match=complaint):
        parse_order(line)


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("{}", "lacks the key 'failure'"),
        ('{"failure": "x", "vehicle": "a", "parameters": {}}', "lacks the key 'is_active'"),
        ('{"failure": "x", "vehicle": "a", "parameters": {}, "is_active": 1}', "is_active must be"),
        ('{"refused": 3}', "refused must be a text"),
        ('{"refused": "x", "failure": "x"}', "unknown key 'failure'"),
    ],
)
def test_a_wrong_event_is_refused_in_a_sentence(line, complaint):
    with pytest.raises(ValueError, match=complaint):
        parse_event(line)
