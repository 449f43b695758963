"""The benchmarks' rows and page: what is kept, what is replaced, what counts as reached."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

ORDER = ["loop", "star", "fusion"]


@pytest.fixture
def page(tmp_path, bench):
    table, row = bench("table"), bench("rows").Row
    path = tmp_path / "page.md"
    path.write_text(f"before\n{table.BEGIN}\n{table.END}\nafter\n")
    sections = {
        "loop": table.section("Monday.", [row("rate", "5x", "9x", ok=True)]),
        "fusion": table.section(
            "Tuesday.", [row("position", "2 mm", "3 mm", ok=False), row("size", "", "1", None)]
        ),
    }
    table.write(path, sections, ORDER)
    return path


def test_a_subject_measured_alone_leaves_the_others_as_they_were(bench, page):
    table, row = bench("table"), bench("rows").Row
    before = page.read_text()
    table.write(page, {"fusion": table.section("Friday.", [row("position", "2 mm", "1 mm", ok=True)])}, ORDER)
    after = page.read_text()
    assert after.split("### fusion")[0] == before.split("### fusion")[0]
    assert "Friday." in after
    assert "Tuesday." not in after
    assert "| position | 2 mm | 1 mm | yes |" in after
    assert "size" not in after, "a row that is no longer measured goes with its subject's table"


def test_a_new_subject_takes_its_place_in_the_order(bench, page):
    table = bench("table")
    table.write(page, {"star": table.section("Friday.", [])}, ORDER)
    reported = page.read_text()
    assert reported.index("### loop") < reported.index("### star") < reported.index("### fusion")


def test_a_subject_that_is_no_more_leaves_the_page(bench, page):
    table = bench("table")
    table.write(page, {}, ["fusion"])
    assert "### loop" not in page.read_text()
    assert "### fusion" in page.read_text()


def test_writing_the_same_twice_changes_nothing(bench, page):
    table = bench("table")
    before = page.read_text()
    table.write(page, {}, ORDER)
    assert page.read_text() == before


def test_the_page_keeps_everything_outside_its_marks(bench, page):
    reported = page.read_text()
    assert reported.startswith("before\n")
    assert reported.endswith("\nafter\n")
    assert list(page.parent.iterdir()) == [page]


def test_a_page_without_marks_is_refused_and_left_alone(bench, tmp_path):
    path = tmp_path / "page.md"
    path.write_text("nothing here")
    with pytest.raises(ValueError, match="needs the marks"):
        bench("table").write(path, {}, ORDER)
    assert path.read_text() == "nothing here"


def test_the_page_of_the_benchmarks_is_one_that_can_be_written(bench, tmp_path):
    table, root = bench("table"), bench("rows").ROOT
    path = tmp_path / "benchmarks.md"
    text = (root / "docs" / "benchmarks.md").read_text()
    path.write_text(text)
    names = table.subjects(text)
    assert names
    table.write(path, {}, names)
    assert path.read_text() == text


def test_a_limit_shows_must_and_aim_and_judges_by_the_must(bench):
    row = bench("limits").at_most("time", (2.0, 6.5), (3.0, 7.0), (1.2, 3.0), "ms", "10 units")
    assert row.cells == ("time", "3 / 7 ms, aim 1.2 / 3", "2 / 6.5 ms (10 units)", "yes")
    assert bench("limits").at_most("time", (2.0, 7.5), (3.0, 7.0)).ok is False
    assert bench("limits").at_least("found", 99.0, 99.5, 100.0, "%").cells[1:] == (
        "at least 99.5 %, aim 100", "99 %", "NO",
    )  # fmt: skip
    assert bench("limits").plain("size", 12345.6).measured == "12346"


@given(high=st.floats(0.1, 1e3))
def test_what_was_not_measured_reaches_no_limit(bench_limits, high):
    for row in (
        bench_limits.at_most("x", math.nan, high),
        bench_limits.at_least("x", math.nan, -high),
        bench_limits.between("x", math.nan, -high, high),
    ):
        assert row.ok is False


@given(number=st.floats(-1e6, 1e6), low=st.floats(-1e6, 1e6), span=st.floats(0.0, 1e6))
def test_a_bound_is_kept_exactly_inside_it(bench_limits, number, low, span):
    assert bench_limits.between("x", number, low, low + span).ok == (low <= number <= low + span)


@given(number=st.floats(1e-3, 1e5))
def test_a_figure_keeps_three_digits(bench_limits, number):
    assert float(bench_limits.short(number)) == pytest.approx(number, rel=0.0051)


def test_limits_and_aims_of_different_length_are_a_mistake(bench):
    with pytest.raises(ValueError, match="1 aims for 2 limits"):
        bench("limits").at_most("x", (1.0, 2.0), (1.0, 2.0), 1.0)
