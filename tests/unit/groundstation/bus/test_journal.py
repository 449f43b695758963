"""The journal keeps order and names, between one publication and the next."""

from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bus.journal import NO_NODE, JournalWriter, Kind, read_entries

U32 = st.integers(0, 2**32 - 1)
notes = st.tuples(
    st.sampled_from(Kind),
    st.none() | st.sampled_from(["alpha/imu", "bravo/imu", "mux"]),
    st.integers(0, 255),
    st.sampled_from(["", "alpha", "bravo", "alpha_flight"]),
    U32,
    st.integers(0, 2**62),
    st.integers(0, 2**40),
)


@settings(derandomize=True)
@given(st.lists(st.lists(notes, max_size=8), max_size=4))
def test_what_was_noted_is_read_back_in_order_with_its_names(publications):
    journal = JournalWriter()
    for batch in publications:
        for note in batch:
            journal.note(*note)
        assert len(journal) == len(batch)
        names, packed = journal.take()
        assert len(journal) == 0
        read = [
            (
                Kind(e["kind"]),
                None if e["node"] == NO_NODE else names[e["node"]],
                int(e["topic"]),
                names[e["owner"]],
                int(e["sequence"]),
                int(e["now_ns"]),
                int(e["wall_ns"]),
            )
            for e in read_entries(packed)
        ]
        assert read == [(*note[:6], min(note[6], 2**32 - 1)) for note in batch]


def test_an_entry_takes_24_bytes():
    journal = JournalWriter()
    journal.note(Kind.TICK, "alpha/imu", 0, "", 0, 5)
    assert len(journal.take()[1]) == 24  # a hundred ticks a second of twenty nodes: 48 kB/s before zstd
