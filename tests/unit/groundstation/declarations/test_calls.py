"""A sentence is one line that any terminal and any file can hold."""

import pytest

from groundstation.declarations.calls import in_one_line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("two\nlines", "two lines"),
        ("a\x1b[2J", "a\\x1b[2J"),
        ("a\udc80b", "a\\udc80b"),
        ("a\u202eb", "a\\u202eb"),
        ("a\x00b", "a\\x00b"),
        ("\u00e4 \u00b5", "\u00e4 \u00b5"),
    ],
)
def test_what_no_sentence_can_hold_is_spelled_out(text, line):
    assert in_one_line(text) == line


def test_what_is_very_long_is_cut():
    assert len(in_one_line("a" * 5000)) < 400
    assert len(in_one_line("a " * 5000)) < 1100
