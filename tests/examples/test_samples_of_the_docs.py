"""Every sample of README and docs: commands are those of the program, Python runs, TOML and JSON can be read.

Commands are parsed as the command line does, and not carried out: most of them fly. What stands in
`samples_not_run.toml` is not tried, for the reason there. Pages that are walked from end to end have tests of
their own.
"""

import json
import re
import tomllib
from datetime import UTC, datetime

import numpy as np
import pytest
import typer
from oracles.docs_samples import ALL, NOT_RUN, OURS, ROOT, commands_of, program

from groundstation.cli.main import build, spelled
from groundstation.fusion.table_map import MapProvenance, TableMap
from groundstation.parts.table import installed_tables

OWN_PACKAGE = ROOT / "examples" / "own_package"
OPTION = re.compile(r"--[a-z][\w-]*")


def of_kind(*kinds):
    found = [sample for sample in ALL if sample.kind in kinds and not sample.reason]
    return pytest.mark.parametrize("sample", found, ids=lambda sample: sample.name)


def check_groundstation(words):
    """Take a command apart as the command line does."""
    words = spelled(words)
    if words[0] == "ranges":
        return  # of examples/own_package, whose test installs and runs it
    if words[0] in ("--install-completion", "--show-completion"):
        return  # typer's own: they act as soon as they are read
    command, parent, rest = typer.main.get_command(build(words)), None, words
    name = "groundstation"
    while True:
        parent = context = command.make_context(name, list(rest), parent=parent)
        if not hasattr(command, "resolve_command"):
            break
        rest = [*context._protected_args, *context.args]
        name, command, rest = command.resolve_command(context, rest)
    given = context.params
    if words[0] == "request":
        row = installed_tables().actions[given["action"]]
        assert len(given["arguments"] or ()) <= len(row.arguments), words
    if words[0] == "inject":
        assert given["failure"] in (ROOT / "docs" / "how_to" / "break_things.md").read_text()


def check_python(words):
    """A script of ours that has these options, or a module of somebody else."""
    if words[0] == "-m":
        assert words[1] in ("pip", "pytest", "http.server"), words
        words = [word for word in words[2:] if word.endswith(".py")]
        assert all((ROOT / word).is_file() for word in words), words
        return
    script = ROOT / words[0]
    text = script.read_text(encoding="utf-8")
    for option in (word for word in words[1:] if OPTION.fullmatch(word)):
        assert option in text, f"{script} has no {option}"


def check_make(words):
    assert re.search(rf"^{words[0]}:", (ROOT / "Makefile").read_text(), re.MULTILINE), words


@of_kind("shell")
def test_every_command_is_one_of_the_program(sample):
    checks = {"groundstation": check_groundstation, "python": check_python, "make": check_make}
    for words in commands_of(sample.text):
        name = program(words[0])
        if name in NOT_RUN["programs"]:
            continue
        assert name in OURS, f"{name} is no program of ours, and samples_not_run.toml does not name it"
        checks[name](words[1 : words.index(">") if ">" in words else None])
        for word in words[1:]:
            if word.startswith(("examples/", "tools/", "docs/", "tests/")):
                assert (ROOT / word.partition("::")[0]).exists(), word


@of_kind("toml")
def test_every_piece_of_toml_can_be_read(sample):
    assert tomllib.loads(sample.text)


@of_kind("text")
def test_every_line_of_json_can_be_read(sample):
    assert "groundstation " not in "".join(re.findall(r"^groundstation .*", sample.text, re.MULTILINE))
    for line in sample.text.splitlines():
        if line.startswith('{"'):
            assert json.loads(line)


RUN = {
    "docs/how_to/read_a_recording.md",
    "docs/how_to/add_a_command.md",
    "docs/how_to/write_a_scenario.md",
    "docs/table_map.md",
}
"""Pages whose blocks of Python a test below runs, all of them."""


@of_kind("python")
def test_every_piece_of_python_is_run_or_stands_in_the_package_that_it_names(sample):
    named = re.match(r"# (range_finder/\w+\.py)\n", sample.text)
    if named is None:
        page = sample.page.relative_to(ROOT).as_posix()
        assert page in RUN, "neither run by a test nor named in samples_not_run.toml"
    else:
        assert sample.text[named.end() :].strip("\n") in (OWN_PACKAGE / named[1]).read_text(encoding="utf-8")


def run(page, **known):
    """Run the blocks of a page one after the other; the names that they leave."""
    assert page in RUN
    blocks = [each for each in ALL if each.page == ROOT / page and each.kind == "python"]
    assert blocks
    for sample in blocks:
        exec(compile(sample.text, sample.name, "exec"), known)
    return known


@pytest.fixture(scope="module")
def flown(groundstation, tmp_path_factory):
    """A folder with a recording of a few seconds in it."""
    folder = tmp_path_factory.mktemp("samples")
    words = ("--lockstep", "--duration", "3", "--record", folder / "run.mcap")
    assert groundstation("run", ROOT / "examples/rigs/drawn_fixes.toml", *words).exit_code == 0
    return folder


def test_a_recording_is_read_as_the_page_reads_it(flown, monkeypatch):
    monkeypatch.chdir(flown)
    assert len(run("docs/how_to/read_a_recording.md")["t_s"]) > 50


def test_a_command_of_the_page_counts_samples(flown, capsys):
    found = run("docs/how_to/add_a_command.md")
    found["weigh"](flown / "run.mcap")
    assert int(capsys.readouterr().out) > 100
    assert found["WEIGH"].target == "my_table.weighing:weigh"


def test_a_table_map_is_asked_as_the_page_asks_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    grid = np.full((21, 21), 1e-3)
    said = MapProvenance(datetime(2026, 1, 2, tzinfo=UTC), {"laps.mcap": "0" * 64}, 1.0, 60.0)
    TableMap(-0.5, -0.5, 0.05, grid, 2 * grid, grid, grid, grid, (0, 0), np.eye(2) * 1e-8, 1e-3, said).save(
        tmp_path / "table_map.toml"
    )
    found = run("docs/table_map.md")
    assert (found["ax"], found["ay"]) == pytest.approx((1e-3, 2e-3))


@pytest.mark.slow
def test_a_scenario_flies_in_python_as_the_page_flies_it(monkeypatch):
    monkeypatch.chdir(ROOT)
    found = run("docs/how_to/write_a_scenario.md", my_law=lambda state, goal, dt_s: (0.0, 0.0, 0.0))
    assert not found["flown"].passed  # who pushes nothing arrives nowhere


def test_what_is_not_run_is_still_there():
    for row in NOT_RUN["sample"]:
        page = ROOT / row["page"]
        if page.exists():
            assert any(each.page == page and each.first == row["first"] for each in ALL), row
        assert row["because"]
