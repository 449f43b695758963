"""Every number of every example rig, replaced by what no rig can mean: one sentence with file and key."""

import re
from pathlib import Path

import pytest

from groundstation.declarations.errors import RigError
from groundstation.rig.read import parse_rig

RIGS = sorted((Path(__file__).parents[4] / "examples" / "rigs").glob("*.toml"))
NUMBER = re.compile(r"^(\w+) = (-?[\d.]+(?:e-?\d+)?)\s*$", re.MULTILINE)
WRONG = {
    "huge": "1e308",
    "minus huge": "-1e308",
    "no number": "nan",
    "a long text": f'"{"x " * 3000}"',
    "a long word": f'"{"x" * 5000}"',
    "thousands of digits": "9" * 5000,
}


def numbers(text):
    """Matches of the rig's own numbers; those of its laboratory are the laboratory's to refuse."""
    tables = [(match.start(), match[1]) for match in re.finditer(r"^\[+([\w.]+)", text, re.MULTILINE)]
    for match in NUMBER.finditer(text):
        table = [name for start, name in tables if start < match.start()]
        if not (table and table[-1].startswith("laboratory")):
            yield match


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("path", RIGS, ids=lambda path: path.stem)
def test_a_number_that_no_rig_can_mean_is_refused_in_a_sentence(path, wrong):
    text = path.read_text()
    found = list(numbers(text))
    assert len(found) > 5
    for match in found:
        with pytest.raises(RigError) as refused:
            parse_rig(text[: match.start(2)] + WRONG[wrong] + text[match.end(2) :], path)
        sentence = str(refused.value)
        assert sentence.startswith(f"{path}: ")
        assert match[1] in sentence or "not valid TOML" in sentence
        assert len(sentence) < 700, sentence
        assert "\n" not in sentence


@pytest.mark.parametrize("key", ["sigma_xy_m", "sigma_heading_rad", "delay_sigma_s", "delay_s", "busy_s"])
@pytest.mark.parametrize("value", ["20.0", "-1.0", "1e9"])
def test_a_sigma_or_delay_beyond_what_anybody_means_is_refused_by_its_key(key, value):
    path = next(path for path in RIGS if path.stem == "overhead")
    text, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", path.read_text())
    assert count
    with pytest.raises(RigError, match=rf"{key}: Input should be"):
        parse_rig(text, path)
