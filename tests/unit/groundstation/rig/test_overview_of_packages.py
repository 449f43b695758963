"""The system as rows: what the page of parts shows is what the parts declare."""

from pathlib import Path

from groundstation.parts.table import installed_tables
from groundstation.rig.overview import as_markdown, overview
from groundstation.rig.read import load_rig

ROOT = Path(__file__).parents[4]


def test_the_page_of_parts_is_up_to_date():
    assert (ROOT / "docs" / "parts.md").read_text() == as_markdown(overview(None)), (
        "groundstation parts --markdown > docs/parts.md"
    )


def test_every_topic_and_part_stands_on_the_page():
    page = as_markdown(overview(None))
    tables = installed_tables()
    assert all(f" | {noun} | " in page for noun in tables.payloads)
    assert all(f"| `{name}` | " in page for name in tables.parts)


def test_a_rig_shows_what_it_uses_and_where():
    view = overview(load_rig(ROOT / "examples" / "rigs" / "drawn_fixes.toml"))
    rows = {row.noun: row for row in view.rows}
    assert view.rig == "one mock-up, published condition, drawn fixes"
    assert rows["star_fix"].publishers == ("fix_reader",)
    assert rows["star_fix"].processes == ("*_flight",)
    assert rows["imu_bytes"].publishers == ("port */imu",)
    assert rows["wrench"].receivers == ("supervisor (commands)", "command_mux (commands)")
    assert "command_mux (commands)" in rows["state"].receivers
    assert rows["star_image"].publishers == ("-",)  # it has no camera
    assert rows["journal"].publishers == ("the runner",)
