"""What can be picked of a rig's topics, and what a wrong name is answered with."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bus.cdr import codec_of, ros_fields
from groundstation.bus.record_stream import Recorded
from groundstation.declarations.errors import UsageError
from groundstation.declarations.request import Ack
from groundstation.declarations.topic import Scope
from groundstation.parts.table import own_tables
from groundstation.watch.pick import picked, shown, stamp_text, topic_names

VEHICLES = ("alpha", "beta")
PAYLOADS = own_tables().payloads


def recorded_of(message, owner):
    return Recorded(type(message).TOPIC.noun, owner, 1, 0, 0, None, codec_of(type(message)).encode(message))


@pytest.mark.parametrize("name", topic_names(PAYLOADS, VEHICLES))
def test_every_topic_and_every_field_can_be_picked(name):
    whole = picked(name, PAYLOADS, VEHICLES)
    assert {column.field for column in whole.columns} == {field for field, _ in ros_fields(whole.kind)}
    for field, _ in ros_fields(whole.kind):
        part = picked(f"{name}.{field}", PAYLOADS, VEHICLES)
        assert {column.field for column in part.columns} == {field}


def test_a_list_of_fixed_length_is_a_column_for_each_element(message_of):
    state = message_of("state", position_table_m=(0.25, -1.5))
    pick = picked("alpha/state.position_table_m", PAYLOADS, VEHICLES)
    assert [column.name for column in pick.columns] == ["position_table_m[0]", "position_table_m[1]"]
    assert [column.value(state) for column in pick.columns] == [0.25, -1.5]
    (one,) = picked("/alpha/state.position_table_m[1]", PAYLOADS, VEHICLES).columns
    assert one.value(state) == -1.5


def test_an_element_that_a_sequence_has_not_is_none(message_of):
    faults = message_of("faults", ids=("dead_sky",))
    first, second = (
        picked(f"alpha/faults.ids[{index}]", PAYLOADS, VEHICLES).columns[0].value(faults) for index in (0, 1)
    )
    assert (first, second) == ("dead_sky", None)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ("alpha/stat", "no topic 'alpha/stat': near it are alpha/state"),
        ("alhpa/state", "near it are alpha/state"),
        ("state", "near it are alpha/state, beta/state"),
        ("alpha/lease", "near it are lease"),
        ("alpha/state.positoin_table_m", "has no field 'positoin_table_m': near it are position_table_m"),
        ("alpha/state.heading_rad[0]", "is no list"),
        ("alpha/state.position_table_m[2]", "a list of 2, counted from 0"),
        ("alpha/state.", "has no field ''"),
        ("", "no topic ''"),
        ("alpha/state.x[y]", "has no field"),
    ],
)
def test_a_wrong_name_is_answered_with_near_ones(asked, words):
    with pytest.raises(UsageError, match=re.escape(words)):
        picked(asked, PAYLOADS, VEHICLES)


@settings(max_examples=30)
@given(asked=st.text(max_size=20))
def test_whatever_is_typed_is_picked_or_refused(asked):
    with pytest.raises(UsageError, match="there is no topic"):
        picked(f"alpha/{asked}\n", PAYLOADS, VEHICLES)


def test_messages_of_others_are_not_picked(message_of):
    pick = picked("alpha/state", PAYLOADS, VEHICLES)
    assert pick.message(recorded_of(message_of("state", "beta"), "beta")) is None
    assert pick.message(recorded_of(message_of("state", "alpha"), "alpha")).vehicle == "alpha"
    assert pick.message(recorded_of(message_of("imu", "alpha"), "alpha")) is None


def test_topics_of_processes_are_picked_by_vehicle_or_by_process():
    assert Ack.TOPIC.scope is Scope.PROCESS
    ack = Ack(0, "alpha", 1, "anna", "land", True, "")
    for asked, is_picked in (("alpha/ack", True), ("commands/ack", True), ("beta/ack", False)):
        found = picked(asked, PAYLOADS, VEHICLES).message(recorded_of(ack, "commands"))
        assert (found is not None) == is_picked


@given(value=st.floats(allow_nan=False))
def test_exact_numbers_can_be_read_back(value):
    assert float(shown(value, exact=True)) == value


def test_values_of_all_kinds_are_shown():
    assert shown(1.23456789, exact=False) == "1.23457"
    assert shown(("a", "b"), exact=True) == "a b"
    assert shown(b"\x01\xff", exact=True) == "01ff"
    assert shown(np.array([0.5, 1.5], np.float32), exact=True) == "0.5 1.5"
    assert shown(None, exact=True) == ""
    assert shown(True, exact=True) == "True"


@given(stamp_ns=st.integers(0, 2**62))
def test_a_stamp_loses_no_nanosecond(stamp_ns):
    seconds, _, rest = stamp_text(stamp_ns).partition(".")
    assert int(seconds) * 1_000_000_000 + int(rest) == stamp_ns


@pytest.fixture
def message_of(message):
    def make(noun, vehicle="alpha", **known):
        return message(PAYLOADS[noun], vehicle, **known)

    return make
