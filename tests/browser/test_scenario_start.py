"""A scenario that waits for a person: started from the console, by whoever holds control."""

from pathlib import Path

import pytest

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "two_mock_ups_drawn.toml"
pytestmark = pytest.mark.slow
S = 1000
SCENARIO = """
name = "started by hand"
rig = "{rig}"
duration_s = 4.0

[[timeline]]
at_s = 0.5
mark = "begun"

[[limits]]
what = "contacts"
vehicle = "all"
below = 1.0
"""


def test_it_waits_is_started_and_judged(opened, launch, tmp_path):
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO.format(rig=RIG))
    waiting = launch("run", path, "--by-hand", "--headless", "--record", tmp_path / "run.mcap")
    page = opened(waiting.address)
    box = page.locator("#scenario")
    box.get_by_text("waits for a person's start_scenario").wait_for(timeout=90 * S)
    start = box.get_by_role("button", name="Start scenario")
    assert start.is_disabled()
    page.get_by_role("button", name="Take control").click()
    page.wait_for_function("() => !document.querySelector('#scenario button').disabled")
    start.click()
    box.get_by_text("running").wait_for(timeout=10 * S)
    assert box.get_by_role("button", name="Start scenario").count() == 0
    assert waiting.process.wait(60) == 0
    assert "verdict: passed" in "\n".join(waiting.lines)
