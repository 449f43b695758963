"""A file of a rig: its bytes, their hash, and what they say, all of one reading."""

import hashlib

import pytest

from groundstation.declarations.rig_file import RigFile


def test_what_is_parsed_are_the_bytes_that_were_hashed(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"of yesterday")
    file = RigFile(path, b"of today")
    assert file.sha256 == hashlib.sha256(b"of today").hexdigest()
    assert file.value(lambda data, where: (data, where)) == (b"of today", path)
    assert file.text() == "of today"


def test_a_file_is_parsed_once_by_each_parser(tmp_path):
    calls = []

    def length(data, where):
        calls.append("length")
        return len(data)

    def first(data, where):
        calls.append("first")
        return data[0]

    file = RigFile(tmp_path / "not there", b"abc")
    assert [file.value(length), file.value(first), file.value(length), file.value(first)] == [3, 97, 3, 97]
    assert calls == ["length", "first"]


def test_what_a_parser_refuses_is_refused_each_time(tmp_path):
    def refuse(data, where):
        raise ValueError(f"{where}: no")

    file = RigFile(tmp_path / "x", b"")
    for _ in range(2):
        with pytest.raises(ValueError, match="x: no"):
            file.value(refuse)


def test_a_mark_of_the_byte_order_is_no_part_of_the_text(tmp_path):
    assert RigFile(tmp_path / "x", b"\xef\xbb\xbfhello").text() == "hello"


def test_what_is_no_text_is_refused_by_the_files_name(tmp_path):
    with pytest.raises(ValueError, match="x: is not a text file"):
        RigFile(tmp_path / "x", b"\xff\xfe\x00").text()
