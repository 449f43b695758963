"""JSON and TOML as nobody writes them by hand: one sentence, at once."""

from pathlib import Path

import pytest

from drivers.files.errors import FileError
from drivers.files.trees import DEEPEST, parse_json, parse_toml

DEEP = 100_000
PATH = Path("given")
TOO_DEEP = rf"^given: (line 1 )?is nested deeper than {DEEPEST} levels\.$"


@pytest.mark.parametrize(
    ("text", "parse"),
    [
        ('{"a": ' * DEEP + "1" + "}" * DEEP, parse_json),
        ('{"a": ' + "[" * DEEP + "]" * DEEP + "}", parse_json),
        ('{"a": ' + "[" * DEEP, parse_json),
        ('{"a": ' + "[" * (DEEPEST + 1) + "]" * (DEEPEST + 1) + "}", parse_json),
        ("a = " + "[" * DEEP + "]" * DEEP, parse_toml),
        ("a = " + "{a = " * DEEP + "1" + "}" * DEEP, parse_toml),
        ("[" + "a." * DEEP + "a]", parse_toml),
        ("a." * DEEP + "a = 1", parse_toml),
        ('"a". ' * DEEP + "a = 1", parse_toml),
        ("a = " + "[" * (DEEPEST + 1) + "]" * (DEEPEST + 1), parse_toml),
    ],
)
def test_what_is_nested_a_hundred_thousand_deep_is_refused_at_once(text, parse):
    with pytest.raises(FileError, match=TOO_DEEP):
        parse(text.encode(), PATH)


def test_what_people_nest_is_read():
    assert parse_toml(b"a = [[[1]]]\n[b.c.d]\ne.f = 2\n", PATH) == {
        "a": [[[1]]],
        "b": {"c": {"d": {"e": {"f": 2}}}},
    }
    assert parse_json(b'{"a": {"b": [{"c": [1]}]}}', PATH) == {"a": {"b": [{"c": [1]}]}}


@pytest.mark.parametrize("parse", [parse_json, parse_toml])
def test_a_number_of_thousands_of_digits_is_refused(parse):
    text = {parse_json: '{"a": %s}', parse_toml: "a = %s"}[parse] % ("9" * 5000)
    with pytest.raises(FileError, match=r"^given: .*digit"):
        parse(text.encode(), PATH)


def test_a_key_that_appears_twice_is_refused_in_json_as_it_is_in_toml():
    with pytest.raises(FileError, match="key 'fx' appears twice"):
        parse_json(b'{"fx": 1, "fy": 2, "fx": 3}', PATH)
    with pytest.raises(FileError, match="is not valid TOML"):
        parse_toml(b"fx = 1\nfx = 3\n", PATH)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_every_unicode_that_an_editor_writes_is_read(encoding):
    text = 'name = "Süd"\r\nx = 1\r\n'
    data = text.encode(encoding)
    if encoding in ("utf-16-le", "utf-16-be"):
        data = "x = 1\r\ny = 2\r\n".encode(encoding)  # no mark: told by the zeros of ASCII
        assert parse_toml(data, PATH) == {"x": 1, "y": 2}
        return
    assert parse_toml(data, PATH) == {"name": "Süd", "x": 1}
