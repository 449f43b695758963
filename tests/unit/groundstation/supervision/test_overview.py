"""What the page of modes and faults shows is what the tables state."""

from pathlib import Path

from groundstation.supervision.arming import CHECKS
from groundstation.supervision.faults import FAULTS
from groundstation.supervision.modes import GUARANTEES, TRANSITIONS
from groundstation.supervision.overview import Shown, as_markdown, tables

PAGE = Path(__file__).parents[4] / "docs" / "faults.md"


def test_the_page_of_faults_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == as_markdown(tables()), (
        "groundstation faults --markdown > docs/faults.md"
    )


def test_every_row_of_every_table_is_shown():
    modes, transitions, checks, faults = tables()
    assert [row[0] for row in modes.rows] == [mode.value for mode in GUARANTEES]
    assert [row[:3:2] for row in transitions.rows] == [(row.event, row.after) for row in TRANSITIONS]
    assert [row[0] for row in checks.rows] == [check.name for check in CHECKS]
    assert [row[0] for row in faults.rows] == list(FAULTS)
    for shown in (modes, transitions, checks, faults):
        assert all(len(row) == len(shown.headings) for row in shown.rows)
        assert all(all(row) for row in shown.rows)


def test_a_fault_is_shown_in_words():
    rows = {row[0]: row for row in tables()[3].rows}
    assert rows["state_silent"][3:7] == (
        "0.5 s", "brakes and holds; brakes, then lands after 0.5 s; cuts the float air after 1.5 s",
        "by itself", "yes",
    )  # fmt: skip
    assert rows["tank_low"][6] == "unless overridden"
    assert rows["leader_old"][6] == "no"
    assert rows["leader_old"][8] == "-"
    assert rows["star_outage"][8] == "dead_sky, silent_camera"


def test_modes_and_transitions_are_shown_in_words():
    modes, transitions, *_ = tables()
    assert modes.rows[3][:4] == ("armed", "closed", "yes", "on where flight is wanted")
    ready = next(row for row in transitions.rows if row[0] == "ready")
    assert ready == ("ready", "resting", "armed", "the station itself", "every check passed (arming gate)")
    assert transitions.rows[0][1] == "landed, resting"


def test_a_stroke_in_a_cell_does_not_end_it():
    page = as_markdown([Shown("T", "Text.", ("a", "b"), (("x|y", "z"),))])
    assert page.endswith("\n## T\n\nText.\n\n| a | b |\n| --- | --- |\n| x\\|y | z |\n")


def test_the_command_prints_page_and_screen(groundstation):
    assert groundstation("faults", "--markdown").stdout == as_markdown(tables())
    screen = groundstation("faults").stdout
    assert screen.startswith("\nModes\n")
    assert all(fault in screen for fault in FAULTS)
