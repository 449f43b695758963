"""What is told of a recorder's troubles: each once, with when; why it stopped."""

import time

import pytest

from groundstation.launch.child import Child, start_python
from groundstation.launch.recorder_troubles import MOST_SHOWN, closing_lines, final_trouble, why_stopped


@pytest.fixture
def recorder():
    made = Child("recorder")
    yield made
    made.release()


def live(recorder, *lines, code=1):
    words = "".join(f"{line}\n" for line in lines)
    recorder.adopt(start_python(["-c", f"import sys; sys.stderr.write({words!r}); sys.exit({code})"]), 0.0)
    recorder.wait(time.monotonic() + 20.0)
    recorder.complaints()


def told(recorder):
    """The lines without their moments."""
    return [line.partition(" s: ")[2] or line for line in closing_lines(recorder, 0.0)]


def test_each_trouble_is_named_once_and_the_last_is_left_to_the_error(recorder):
    live(recorder, "a is lost", "it goes on in b", "b is lost", "it goes on in c", "b is lost")
    assert told(recorder) == ["a is lost", "it goes on in b", "it goes on in c"]
    assert final_trouble(recorder, 0.0).startswith("b is lost (After ")


def test_every_line_says_when(recorder):
    recorder.history += [(12.25, "a is lost"), (13.0, "b is lost"), (14.0, "a is lost")]
    assert list(closing_lines(recorder, 10.0)) == [
        "recorder, after 2.2 s: a is lost (2 times)",
        "recorder, after 3.0 s: b is lost",
    ]


def test_lives_that_ended_count_and_why_none_runs_is_known_until_it_is_started_again(recorder):
    assert why_stopped(recorder) == ""
    live(recorder, "x.mcap cannot be written", code=2)
    recorder.back_off(5.0)
    assert why_stopped(recorder) == "ended with code 2 (x.mcap cannot be written)"
    live(recorder, code=0)
    assert why_stopped(recorder) == ""
    assert final_trouble(recorder, 0.0) == ""
    assert told(recorder) == ["x.mcap cannot be written", "ended with code 2 (x.mcap cannot be written)"]


def test_of_very_many_the_first_are_named(recorder):
    recorder.history += [(1.0, f"trouble {number}") for number in range(MOST_SHOWN + 5)]
    assert told(recorder)[-1] == "recorder: and 5 more"
    assert len(told(recorder)) == MOST_SHOWN + 1


def test_without_a_recorder_nothing_is_told():
    assert list(closing_lines(None, 0.0)) == []
    assert (final_trouble(None, 0.0), why_stopped(None)) == ("", "")
