"""A child of the launcher: its lines, its end, its next start."""

import os
import signal
import time

import pytest

from groundstation.launch.child import FIRST_BACK_OFF_S, LAST_BACK_OFF_S, REFUSAL, Child, Lines, start_python


@pytest.fixture
def child():
    made = Child("test")
    yield made
    made.release()


def run(child, program):
    child.adopt(start_python(["-c", program]), 0.0)
    child.wait(time.monotonic() + 10.0)


def test_lines_come_once_and_whole():
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb") as pipe:
        lines = Lines(pipe)
        os.write(writing, b"first\nsec")
        assert lines.take() == ["first"]
        assert lines.take() == []
        os.write(writing, b"ond \xff\r\nlast")
        assert lines.take() == ["second \ufffd"]
        os.close(writing)
        assert lines.take() == ["last"]
        assert lines.take() == []


def test_who_writes_without_end_does_not_keep_the_reader():
    child = Child("test")
    child.adopt(start_python(["-c", "import sys\nwhile True: sys.stderr.write('x' * 999 + '\\n')"]), 0.0)
    until_s = time.monotonic() + 10.0
    while not child.complaints():
        assert time.monotonic() < until_s
    child.release()


def test_how_it_ended_holds_its_last_words(child):
    run(child, "import sys; sys.stderr.write('first\\nwhat is wrong\\n\\n'); sys.exit(3)")
    assert child.how_it_ended() == "ended with code 3 (what is wrong)"
    assert child.complaints() == ["first", "what is wrong", ""]
    assert child.complaints() == []


def test_a_signal_is_named(child):
    run(child, "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    assert child.has_ended
    assert child.how_it_ended() == f"was ended by {signal.SIGKILL.name}"


def test_a_refusal_counts_only_before_it_was_ever_ready(child):
    run(child, f"import sys; sys.exit({REFUSAL})")
    assert child.has_refused
    child.has_been_ready = True
    assert not child.has_refused


def test_what_is_written_arrives_and_an_ended_child_is_no_error(child):
    child.adopt(start_python(["-c", "print(input(), flush=True)"]), 0.0)
    child.write(b"go\n")
    child.wait(time.monotonic() + 10.0)
    assert child.output() == ["go"]
    child.write(b"again\n")
    child.ask_to_end()
    child.kill()


def test_the_wait_for_the_next_start_doubles_up_to_a_limit(child):
    run(child, "")
    now_s = time.monotonic()
    waits = [child.back_off(now_s) for _ in range(8)]
    assert waits[:3] == [FIRST_BACK_OFF_S, 2 * FIRST_BACK_OFF_S, 4 * FIRST_BACK_OFF_S]
    assert waits[-1] == LAST_BACK_OFF_S
    assert child.back_off(now_s + 60.0) == FIRST_BACK_OFF_S  # its last life was long
    assert child.state == "waiting"
