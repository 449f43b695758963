"""The journal keeps order and names, between one publication and the next."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.journal import (
    NO_NODE,
    Entry,
    Journal,
    JournalWriter,
    Kind,
    NoJournal,
    packed_entries,
    read_entries,
)

U32 = st.integers(0, 2**32 - 1)
notes = st.tuples(
    st.sampled_from(Kind),
    st.none() | st.sampled_from(["alpha/imu", "bravo/imu", "mux"]),
    st.sampled_from(["", "imu", "state", "alpha"]),  # a noun may be spelt like an owner
    st.sampled_from(["", "alpha", "bravo", "alpha_flight"]),
    U32,
    st.integers(0, 2**62),
    st.integers(0, 2**40),
)


def published(journal: JournalWriter) -> Journal:
    return Journal(0, "", "flight", *journal.take())


@settings(derandomize=True)
@given(st.lists(st.lists(notes, max_size=8), max_size=4))
def test_what_was_noted_is_read_back_in_order_with_its_names(publications):
    journal = JournalWriter()
    for batch in publications:
        for note in batch:
            journal.note(*note)
        assert len(journal) == len(batch)
        payload = published(journal)
        assert len(journal) == 0
        assert list(read_entries(codec_of(Journal).decode(codec_of(Journal).encode(payload)))) == [
            Entry(now_ns, kind, node or "", noun, owner, sequence, min(wall_ns, 2**32 - 1))
            for kind, node, noun, owner, sequence, now_ns, wall_ns in batch
        ]


def test_an_entry_takes_24_bytes():
    journal = JournalWriter()
    journal.note(Kind.TICK, "alpha/imu", "", "", 0, 5)
    assert len(journal.take()[1]) == 24  # a hundred ticks a second of twenty nodes: 48 kB/s before zstd


def test_every_publication_can_be_read_alone():
    """What a recording lost does not take the names of the rest with it."""
    journal = JournalWriter()
    journal.note(Kind.INPUT, "alpha/fusion", "imu", "alpha", 1, 5)
    published(journal)
    journal.note(Kind.INPUT, "alpha/fusion", "star_fix", "alpha", 7, 6)
    assert list(read_entries(published(journal))) == [
        Entry(6, Kind.INPUT, "alpha/fusion", "star_fix", "alpha", 7, 0)
    ]


def test_packed_entries_say_which_of_them_are_of_ports():
    journal = JournalWriter()
    journal.note(Kind.PORT, None, "imu_bytes", "alpha", 1, 5)
    journal.note(Kind.INPUT, "alpha/imu_reader", "imu_bytes", "alpha", 1, 5)
    packed = packed_entries(published(journal))
    assert (packed["node"] == NO_NODE).tolist() == [True, False]
    assert packed["now_ns"].tolist() == [5, 5]


def test_a_run_that_nobody_records_keeps_no_journal():
    journal = NoJournal()
    journal.note(Kind.TICK, "alpha/imu", "", "", 0, 5)
    assert len(journal) == 0
    assert journal.take() == ((), b"")


@pytest.mark.parametrize(
    ("names", "change", "sentence"),
    [
        (("alpha/imu", "imu", "alpha"), lambda entries: entries[:-1], "47 bytes are no whole entries"),
        (("alpha/imu", "imu"), bytes, "points to name 2 of 2"),
        ((), bytes, "points to name 0 of 0"),
        (("alpha/imu", "imu", "alpha"), lambda e: e[:16] + b"\7" + e[17:], "an entry of kind 7"),
    ],
)
def test_entries_that_do_not_hold_together_are_refused(names, change, sentence):
    """Who follows a journal looks names up without a doubt: what is damaged is found when it is read."""
    journal = JournalWriter()
    journal.note(Kind.INPUT, "alpha/imu", "imu", "alpha", 1, 5)
    journal.note(Kind.TICK, "alpha/imu", "imu", "alpha", 0, 6)
    kept, entries = journal.take()
    Journal(0, "", "flight", kept, entries).check()
    with pytest.raises(CodecError, match=sentence):
        Journal(0, "", "flight", names, change(entries)).check()
