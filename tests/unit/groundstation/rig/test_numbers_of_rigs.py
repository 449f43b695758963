"""Every number of every example rig, replaced by what no rig can mean: one sentence with file and key."""

import re
import tomllib
import typing
from pathlib import Path

import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from firmware_emulator.device_table import _model, device_kinds, read_config
from groundstation.control.controllers import controllers
from groundstation.declarations.errors import RigError
from groundstation.files.amounts import check_amounts
from groundstation.parts.table import installed_tables
from groundstation.rig.compose import rig_model
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
    "hundreds of digits": "9" * 400,
    "nested deeply": "[" * 100_000 + "]" * 100_000,
    "a list": "[[1.0]]",
    "1e11": "1e11",
    "minus 1e11": "-1e11",
    "next to nothing": "1e-300",
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
        assert match[1] in sentence or "not valid TOML" in sentence or "nested deeper" in sentence
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


def models(annotation):
    """The tables that an annotation of a key holds."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in typing.get_args(annotation):
        yield from models(inner)


def tables(model, seen):
    if model not in seen:
        seen.add(model)
        for field in model.model_fields.values():
            for inner in models(field.annotation):
                tables(inner, seen)
    return seen


def holds_numbers(annotation):
    inner = typing.get_args(annotation)
    return annotation in (int, float) or any(map(holds_numbers, inner))


STATION = sorted(tables(rig_model(installed_tables()), set()), key=lambda model: model.__qualname__)
LABORATORY = sorted(tables(_model(device_kinds()), set()), key=lambda model: model.__qualname__)
CONTROL = sorted(
    {each for row in controllers().values() for each in tables(row.config, set())},
    key=lambda model: model.__qualname__,
)
UNBOUNDED = {"seed", "seed_offset", "end_s"}
"""Numbers without a size, and what may last for ever."""


@pytest.mark.parametrize("wild", [1.1e10, -1.1e10, 1e300, -1e300, 10**400, 1e-300, -1e-300])
@pytest.mark.parametrize("model", [*STATION, *LABORATORY], ids=lambda model: model.__qualname__)
def test_every_number_of_every_table_has_a_range(model, wild):
    """Also of those that no example has: whatever a part or a device adds."""
    for name, field in model.model_fields.items():
        if not holds_numbers(field.annotation) or name in UNBOUNDED or list(models(field.annotation)):
            continue
        values = {"dict": {"a": wild}, "tupl": (wild, wild)}
        value = values.get(str(field.annotation).removeprefix("typing.")[:4], wild)
        raw = model.model_construct(**{name: value})
        for other in set(model.model_fields) - {name}:
            object.__setattr__(raw, other, None)
        with pytest.raises((ValidationError, ValueError)):
            judged(model, raw, name, field, value)


def judged(model, raw, name, field, value):
    if field.metadata:
        TypeAdapter(typing.Annotated[field.annotation, *field.metadata]).validate_python(value)
    if name == "start_s" or name == "parameters":
        check_amounts({name: value})  # what FailureConfig asks of both
    else:
        raw._is_moderate()


@pytest.mark.parametrize("wild", ["1.1e10", "-1e300", "1e-300"])
@pytest.mark.parametrize("model", CONTROL, ids=lambda model: model.__qualname__)
def test_every_parameter_of_every_controller_has_a_range(model, wild):
    text = next(path for path in RIGS if path.stem == "drawn_fixes").read_text()
    found = [name for name, field in model.model_fields.items() if holds_numbers(field.annotation)]
    for name in found:
        if list(models(model.model_fields[name].annotation)):
            continue
        added = f'\n[mock_ups.standard.control]\ncontroller = "station"\nparameters = {{ {name} = {wild} }}\n'
        with pytest.raises(RigError, match=rf"'{name}' is .*, expected|{name}: Input should be"):
            parse_rig(text + added, Path("rig.toml"))


@pytest.mark.parametrize("wild", ["1e11", "-1e300", "1e-300", "nan", "9" * 400, "[[1.0]]"])
@pytest.mark.parametrize("path", RIGS, ids=lambda path: path.stem)
def test_a_number_that_no_laboratory_can_mean_is_refused_by_its_key(path, wild):
    text = path.read_text()
    own = {match.start() for match in numbers(text)}
    found = [match for match in NUMBER.finditer(text) if match.start() not in own and match[1] != "seed"]
    assert len(found) > 1
    for match in found:
        try:
            table = tomllib.loads(text[: match.start(2)] + wild + text[match.end(2) :])["laboratory"]
            read_config(table)
        except ValidationError as error:
            first = error.errors()[0]
            assert match[1] in (*map(str, first["loc"]), *re.findall(r"'(\w+)'", first["msg"]))
        else:
            raise AssertionError(f"{match[0]} may be {wild}")


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("mass_kg", 1e300, "'mass_kg' is 1e+300, expected at most 10000 kg"),
        ("delay_s", 1e9, "'delay_s' is 1e+09, expected at most 100000 s"),
        ("x_m", -1500.0, "'x_m' is -1500, expected at most 100 m"),
        (
            "tempco_rad_s_k",
            10**400,
            "'tempco_rad_s_k' is a number of hundreds of digits, expected at most 10",
        ),
        ("inertia_kg_m2", 1e-300, "'inertia_kg_m2' is 1e-300, expected 0 or at least 1e-12 kg_m2"),
        ("share", 1e11, "'share' is 1e+11, expected at most 1e+10"),
    ],
)
def test_a_number_is_judged_by_the_unit_that_its_name_ends_in(name, value, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        check_amounts({"a": {"b": 1.0, name: [0.0, value]}})
    check_amounts({name: 0.5, "anything": "x", "is_so": True, "none": None, "path": Path("x")})
