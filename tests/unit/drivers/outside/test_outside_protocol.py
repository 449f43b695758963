"""Texts of programs outside: what is taken, and that whatever else comes is one counted sentence."""

import contextlib
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.outside.protocol import (
    LONGEST_BYTES,
    TextError,
    Wrong,
    answer_text,
    read_request,
    read_wrench,
    split_key,
)

WRENCH = {"author": "anna", "id": 7, "force_x_n": 0.05, "force_y_n": -1, "torque_nm": 0.0}
REQUEST = {"author": "anna", "id": 7, "action": "go_to", "arguments": {"x_m": 0.2}}


def text(base, **changed):
    return json.dumps({key: value for key, value in {**base, **changed}.items() if value is not ...}).encode()


def wrong(read, given):
    with pytest.raises(TextError) as error:
        read(given)
    assert len(str(error.value)) < 200
    assert str(error.value).isprintable()
    return error.value.wrong


def test_a_wrench_is_read_with_whole_numbers_and_keys_of_no_concern():
    wrench = read_wrench(text(WRENCH, sent_at="noon"))
    assert (wrench.author, wrench.id) == ("anna", 7)
    assert (wrench.force_body_n, wrench.torque_nm) == ((0.05, -1.0), 0.0)


def test_a_request_is_read_with_its_arguments_or_without():
    request = read_request(text(REQUEST))
    assert (request.author, request.id, request.action) == ("anna", 7, "go_to")
    assert json.loads(request.arguments) == {"x_m": 0.2}
    assert read_request(text(REQUEST, arguments=...)).arguments == "{}"


@pytest.mark.parametrize(
    "given",
    [
        b"", b"\xff\xfe", b"[1, 2]", b"5", b"null", b"{", b"\0" * 100, b"[" * 4000, b'{"id": ' + b"9" * 4050,
        b"{'author': 'anna'}",
    ],
)  # fmt: skip
def test_what_is_no_json_object_is_said_to_be_none(given):
    assert wrong(read_wrench, given) is wrong(read_request, given) is Wrong.NO_JSON


@pytest.mark.parametrize("given", [b" " * (LONGEST_BYTES + 1), b"x" * 1_000_000])
def test_a_long_text_is_not_even_parsed(given):
    assert wrong(read_wrench, given) is wrong(read_request, given) is Wrong.TOO_LONG


@pytest.mark.parametrize("key", WRENCH)
def test_every_key_of_a_wrench_is_needed(key):
    assert wrong(read_wrench, text(WRENCH, **{key: ...})) is Wrong.MISSING


@pytest.mark.parametrize("key", ["author", "id", "action"])
def test_a_request_needs_its_keys(key):
    assert wrong(read_request, text(REQUEST, **{key: ...})) is Wrong.MISSING


@pytest.mark.parametrize("key", ["force_x_n", "force_y_n", "torque_nm"])
@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (float("nan"), Wrong.RANGE), (float("inf"), Wrong.RANGE), (1e308, Wrong.RANGE),
        (-1000.1, Wrong.RANGE), (10**400, Wrong.RANGE), ("0.1", Wrong.TYPE), (True, Wrong.TYPE),
        (None, Wrong.TYPE), ([1.0], Wrong.TYPE),
    ],
)  # fmt: skip
def test_a_force_is_a_finite_number_that_is_not_absurd(key, value, expected):
    assert wrong(read_wrench, text(WRENCH, **{key: value})) is expected


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"id": -1}, Wrong.RANGE), ({"id": 2**32}, Wrong.RANGE), ({"id": 1.0}, Wrong.TYPE),
        ({"id": True}, Wrong.TYPE), ({"author": ""}, Wrong.RANGE), ({"author": 5}, Wrong.TYPE),
        ({"author": "a\nb"}, Wrong.RANGE), ({"author": "\ud800"}, Wrong.RANGE),
        ({"author": "a" * 65}, Wrong.RANGE),
    ],
)  # fmt: skip
def test_who_and_which_are_checked(changed, expected):
    assert wrong(read_wrench, text(WRENCH, **changed)) is expected


def test_arguments_are_an_object():
    assert wrong(read_request, text(REQUEST, arguments=[1])) is Wrong.TYPE


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.one_of(st.binary(max_size=200), st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.dictionaries(st.sampled_from([*WRENCH, "action", "arguments"]), inner),
).map(lambda value: json.dumps(value).encode())))  # fmt: skip
def test_nothing_else_is_ever_raised(content):
    for read in (read_wrench, read_request):
        with contextlib.suppress(TextError):
            found = read(content)
            assert found.author
            assert 0 <= found.id < 2**32


def test_an_answer_is_one_json_object():
    answer = json.loads(answer_text("ä", 3, "wrench", accepted=False, reason='"no"'))
    assert answer == {"author": "ä", "id": 3, "action": "wrench", "accepted": False, "reason": '"no"'}


def test_keys_have_a_vehicle_and_a_noun():
    assert split_key("outside/alpha/wrench") == ("alpha", "wrench")
    assert split_key("alpha/wrench") == split_key("") == ("", "")
