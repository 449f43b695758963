"""Studies: what is declared, how a number is judged, what the page and results.json say."""

import json
import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from groundstation.declarations.errors import UsageError
from groundstation.rig.read import load_rig, read_text
from groundstation.scenario.loading import made
from groundstation.scenario.scenario_file import WHAT, content_of
from groundstation.studies import table
from groundstation.studies.air_table.study import AIR_TABLE
from groundstation.studies.flown import FlightRow
from groundstation.studies.page import render_page
from groundstation.studies.plots import Axes, Line, Plan, over_time
from groundstation.studies.running import StudyInterrupted, reproduce, results_of
from groundstation.studies.study import DEFAULT, PUBLISHED, Drawn, FigureRow, Generated, Number, Study

DRAWN = Drawn(
    [("A line <here>.", "<svg></svg>")],
    [
        Number("mean, s", 0.72, 0.75, 0.6, "so & so", ratio=1.1),
        Number("worst, s", 2.7, 9.0, 0.6, ratio=1.5),
        Number("drift, mm", ours=3.0),
    ],
    "What is seen.",
)
ROW = FigureRow((3, 4), "lines", "A line.", (), lambda flights: DRAWN, ("the speed",))
STUDY = Study("made", "Made up", "By nobody.", {}, (ROW,), {"Figure 1": "a photograph"})


@pytest.mark.parametrize(
    ("published", "ours", "ratio", "comes_out"),
    [
        (0.72, 0.80, 1.2, True),
        (0.72, 0.90, 1.2, False),
        (0.72, 0.61, 1.2, True),
        (0.72, 0.59, 1.2, False),
        (-0.004, -0.0041, 1.1, True),
        (0.005, -0.005, 1.1, False),  # of the other sign
        (0.72, math.nan, 1.2, False),
        (math.nan, 1.0, 1.2, None),
        (0.72, 0.72, None, None),
        (0.0, 0.0, 1.2, True),
    ],
)
def test_a_number_comes_out_within_its_factor(published, ours, ratio, comes_out):
    assert Number("x", published, ours, ratio=ratio).comes_out is comes_out


def test_a_number_that_was_put_in_proves_nothing():
    number = Number("x", 0.6, 0.6, ratio=1.1, is_put_in=True)
    assert number.comes_out is None
    page = render_page(STUDY, [(ROW, replace(DRAWN, numbers=[number]))])
    assert ">put in<" in page
    assert "No published number is judged" in page


def test_the_page_shows_what_does_not_come_out_and_asks_for_nothing_else():
    page = render_page(STUDY, [(ROW, DRAWN)])
    assert "1 published numbers come out" in page
    assert ">does not come out<" in page
    assert page.count("not stated") == 2  # the drift, and the words above
    assert "A line &lt;here&gt;." in page
    assert "so &amp; so" in page
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page
    assert "http" not in page.replace("http://www.w3.org/2000/svg", "")
    assert "Figures 3, 4: lines" in page
    assert "a photograph" in page
    assert "the speed" in page


def test_results_have_a_row_per_number_and_null_where_nothing_is_stated():
    rows = results_of([(ROW, DRAWN), (replace(ROW, numbers=(2,), kind="table"), DRAWN)])
    assert rows[0] == {
        "figure": "3, 4",
        "quantity": "mean, s",
        "published": 0.72,
        "ours": 0.75,
        "default": 0.6,
        "assumed": "so & so the speed",
        "comes_out": True,
        "put_in": False,
    }
    assert (rows[2]["published"], rows[2]["ours"], rows[2]["default"]) == (None, 3.0, None)
    assert rows[3]["table"] == "2"


def test_a_study_without_flights_is_written_whole(tmp_path):
    said = []
    page, results = reproduce(STUDY, STUDY.figures, tmp_path, lambda text, done: said.append((text, done)))
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert len(json.loads(results.read_text(encoding="utf-8"))) == 3
    assert said == [("drawing figures 3, 4", 0.0)]
    assert not (tmp_path / "flights").exists()


@pytest.mark.parametrize("study", table.studies().values(), ids=lambda study: study.name)
def test_every_flight_of_a_study_can_be_made_on_both_sides(study):
    for row in study.sources.values():
        assert row.size > 0.0
        if not isinstance(row, FlightRow):
            continue
        assert set(row.rigs) == {PUBLISHED, DEFAULT}
        for rig in row.rigs.values():
            content = content_of(read_text(row.scenario, WHAT), row.scenario)
            assert made(content, row.scenario, load_rig(rig)).rig.vehicles
    for figure in study.figures:
        assert set(figure.needs) <= set(study.sources)
    drawn = [(figure.kind, number) for figure in study.figures for number in figure.numbers]
    assert len(drawn) == len(set(drawn))


def test_every_figure_of_the_paper_is_drawn_or_said_why_not():
    drawn = {number for figure in AIR_TABLE.figures for number in figure.numbers}
    words = " ".join(AIR_TABLE.not_drawn).replace(",", " ").split()
    assert drawn | {int(word) for word in words if word.isdecimal()} == set(range(1, 25))


class Point:
    name, value, dist = "other", "other:STUDY", None

    def __init__(self, found):
        self.found = found

    def load(self):
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


def test_a_package_adds_a_study(monkeypatch):
    monkeypatch.setattr(table, "entry_points", lambda group: [Point(STUDY)])
    assert list(table.studies()) == ["air-table", "chibis", "differential-evolution", "made"]


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (ImportError("gone"), "cannot be loaded"),
        ("no study", "is no Study"),
        (AIR_TABLE, "another study 'air-table'"),
    ],
)
def test_a_study_that_is_none_is_named(monkeypatch, found, words):
    monkeypatch.setattr(table, "entry_points", lambda group: [Point(found)])
    with pytest.raises(UsageError, match=words):
        table.studies()


def test_studies_are_listed_and_what_is_not_there_is_named(groundstation, tmp_path):
    listed = groundstation("reproduce").stdout
    assert "air-table" in listed
    assert "Figures 21, 22, 23, 24" in listed
    for words, sentence in (
        (("nothing",), "there is no study 'nothing'"),
        (("air-table",), "--out is needed"),
        (("air-table", "--out", tmp_path, "--figure", "12"), "has no figure 12"),
        (("chibis", "--out", tmp_path, "--figure", "2.3"), "has no figure 2.3"),
        (
            ("differential-evolution", "--out", tmp_path, "--figure", "9"),
            "it draws figures 2, 3, 5, 6; tables 1, 2",
        ),
        (("--figure", "8"), "name a study"),
    ):
        with pytest.raises(UsageError, match=sentence):
            groundstation("reproduce", *words)
    assert not list(tmp_path.iterdir())


def test_a_figure_that_needs_no_flight_is_drawn_alone(groundstation, tmp_path):
    groundstation("reproduce", "air-table", "--out", tmp_path, "--figure", "4")
    rows = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    triangles = next(row for row in rows if "triangles" in row["quantity"])
    assert (triangles["published"], triangles["ours"], triangles["comes_out"]) == (322, 348, False)


def test_a_figure_is_named_as_it_is_printed(groundstation, tmp_path):
    groundstation("reproduce", "chibis", "--out", tmp_path, "--figure", "2.1")
    rows = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert {row["figure"] for row in rows} == {"2.1, 2.2"}
    assert 'id="figure-2.1"' in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_generated_data_are_made_once_and_progress_grows(tmp_path):
    calls = []

    def make(progress):
        calls.append(1)
        progress("making", 0.5)
        return 7

    def draw(data):
        assert data == {"numbers": 7}
        return DRAWN

    rows = tuple(replace(ROW, numbers=(f"1.{k}",), needs=("numbers",), draw=draw) for k in (1, 2))
    sources = {"numbers": Generated(make, 3.0), "other": Generated(lambda _: 1 / 0)}
    said = []
    study = replace(STUDY, sources=sources, figures=rows, about="By hand.")
    reproduce(study, rows, tmp_path, lambda text, done: said.append((text, done)))
    assert calls == [1]
    assert said == [
        ("making", 0.375),
        ("drawing figure 1.1", 0.75),
        ("drawing figure 1.2", 0.875),
    ]
    assert "By hand." in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_picture_over_time_holds_lines_dots_and_marks():
    t = np.linspace(0.0, 10.0, 50)
    lines = [Line("one", "v0", t, np.sin(t)), Line("dots", "v1", t, np.cos(t), is_dots=True)]
    panels = [Axes("a, m", lines), Axes("b", lines[:1], (0.0, 2.0))]
    picture = over_time(panels, 0.0, 10.0, "two", (3.0, 12.0))
    assert picture.count('class="line v0"') == 2 + 1  # and its entry in the legend
    assert picture.count('class="dots v1"') == 1
    assert picture.count('class="injected"') == 2  # in each panel; 12 s lies outside
    assert 'aria-label="two"' in picture


def test_a_plan_keeps_its_scale_along_both_axes():
    plan = Plan((-1.0, 1.0), (-0.5, 0.5))
    (x0, x1), (y0, y1) = plan.place(np.array([0.0, 0.1]), np.array([0.0, 0.1]))
    assert x1 - x0 == pytest.approx(y0 - y1)  # y grows upwards on the table
    drawn = plan.asterisks(np.array([0.0]), np.array([0.0]), "failure") + plan.arrows(*np.zeros((4, 1)))
    assert drawn.count("<path") == 2


def of_figures(*numbers, draw=lambda data: DRAWN, name="made"):
    rows = tuple(replace(ROW, numbers=(number,), draw=draw) for number in numbers)
    return replace(STUDY, name=name, figures=rows)


@pytest.mark.parametrize(
    ("before", "words"),
    [
        (of_figures(1, 2, 3), r"holds 1 more of the study \(figure 3\), and its report would be replaced"),
        (of_figures(3), "holds 1 more"),
        (of_figures(1, name="another"), "holds results of something else than made: give another --out"),
    ],
)
def test_a_report_that_shows_more_is_not_replaced(tmp_path, before, words):
    reproduce(before, before.figures, tmp_path, lambda text, done: None)
    held = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    whole = of_figures(1, 2, 3)
    with pytest.raises(UsageError, match=words):
        reproduce(whole, whole.figures[:2], tmp_path, lambda text, done: None)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == held


@pytest.mark.parametrize("name", ["report.html", "results.json"])
def test_a_file_of_something_else_is_not_replaced(tmp_path, name):
    (tmp_path / name).write_text("mine")
    with pytest.raises(UsageError, match="holds results of something else"):
        reproduce(STUDY, STUDY.figures, tmp_path, lambda text, done: None)
    assert (tmp_path / name).read_text() == "mine"


def test_the_same_figures_or_more_replace_a_report(tmp_path):
    whole = of_figures(1, 2, 3)
    for count in (1, 1, 3):
        reproduce(whole, whole.figures[:count], tmp_path, lambda text, done: None)
    assert len(json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))) == 9


@dataclass(frozen=True)
class Kept:
    """A source that leaves a file, or is interrupted over it."""

    is_interrupted: bool
    size: float = 1.0

    def make(self, name, folder, progress):
        progress(f"flying {name}", 0.5)
        if self.is_interrupted:
            raise KeyboardInterrupt
        (folder / "flights").mkdir(exist_ok=True)
        (folder / "flights" / f"{name}.mcap").write_text("whole")


def test_ctrl_c_says_what_is_finished_and_what_is_not(groundstation, monkeypatch, tmp_path):
    row = replace(ROW, needs=("one", "two"))
    study = replace(STUDY, sources={"one": Kept(False), "two": Kept(True)}, figures=(row,))
    monkeypatch.setattr(table, "entry_points", lambda group: [Point(study)])
    result = groundstation("reproduce", "made", "--out", tmp_path / "new")
    words = result.stderr
    assert result.exit_code == 130
    assert f"interrupted while flying two: finished in {tmp_path / 'new'}: flights/one.mcap; report" in words
    assert words.endswith("report.html and results.json were not written.\n")
    fresh = replace(study, sources={"one": Kept(True), "two": Kept(True)})
    with pytest.raises(StudyInterrupted, match="while flying one: nothing was finished in"):
        reproduce(fresh, fresh.figures, tmp_path / "new", lambda text, done: None)
    with pytest.raises(StudyInterrupted, match="nothing was finished in"):
        reproduce(fresh, fresh.figures, tmp_path / "made" / "for_nothing", lambda text, done: None)
    assert not (tmp_path / "made").exists()
    done = replace(study, sources={"one": Kept(False), "two": Kept(False)})
    reproduce(done, done.figures, tmp_path / "new", lambda text, done: None)
    with pytest.raises(StudyInterrupted, match="those that are there are of an earlier run"):
        reproduce(study, study.figures, tmp_path / "new", lambda text, done: None)


def test_a_flight_that_is_interrupted_leaves_what_was_there(monkeypatch, tmp_path):
    row = next(source for source in AIR_TABLE.sources.values() if isinstance(source, FlightRow))
    (tmp_path / "flights").mkdir()
    (tmp_path / "flights" / "x_published.mcap").write_text("before")

    def stop(text, share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        row.make("x", tmp_path, stop)
    assert [path.name for path in (tmp_path / "flights").iterdir()] == ["x_published.mcap"]
    assert (tmp_path / "flights" / "x_published.mcap").read_text() == "before"
