"""A recording in the console: scrubbed, played, searched, laid over by another."""

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
RECORDINGS = Path(__file__).parents[1] / "replay" / "recordings"
SIZES = ["phone", "tablet", "laptop"]


@pytest.fixture
def served(launch):
    """The console over two recordings of a formation whose leader's valve sticks."""
    return launch("console", RECORDINGS / "formation.mcap", "--beside", RECORDINGS / "drawn_fixes.mcap")


def shown_s(page):
    """The time in the recording that the page shows."""
    minutes, seconds = re.match(r"(\d+):(\d+\.\d)", page.get_by_role("timer").inner_text()).groups()
    return 60 * int(minutes) + float(seconds)


def is_near(page, t_s, within_s=0.15):
    page.wait_for_function(
        "([t_s, within_s]) => { const [, minutes, seconds] = /(\\d+):(\\d+\\.\\d)/.exec("
        "document.querySelector('[role=timer]').textContent);"
        "return Math.abs(60 * minutes + Number(seconds) - t_s) < within_s; }",
        arg=[t_s, within_s],
    )


@pytest.mark.parametrize("size", SIZES)
def test_it_is_scrubbed_to_any_moment_and_shows_the_vehicles_there(opened, served, api, size):
    page = opened(served.address, size)
    slider = page.get_by_label("Time in the recording")
    poses = []
    for t_s in (4.5, 2.0):
        slider.fill(str(t_s))
        is_near(page, t_s)
        alpha = api(page)["vehicles"]["alpha"]
        poses.append((alpha["x_m"], alpha["y_m"], alpha["heading_rad"]))
    assert poses[0] != poses[1]
    assert page.get_by_role("button", name="STOP").is_visible()
    page.get_by_text("dashed: drawn_fixes.mcap").wait_for()


def test_it_is_played_at_a_speed_and_paused(opened, served):
    page = opened(served.address)
    page.get_by_label("Time in the recording").fill("1")
    is_near(page, 1.0)
    page.get_by_label("Speed").select_option("5")
    page.get_by_role("button", name="Play", exact=True).click()
    page.wait_for_function(
        "() => Number(document.querySelector('[aria-label=\"Time in the recording\"]').value) > 3"
    )
    page.get_by_role("button", name="Pause", exact=True).click()
    page.get_by_role("button", name="Play", exact=True).wait_for()
    assert shown_s(page) > 2.9


def test_it_jumps_to_the_next_fault_and_names_it(opened, served):
    page = opened(served.address)
    page.get_by_label("Time in the recording").fill("1")
    is_near(page, 1.0)
    page.get_by_role("button", name="Next fault").click()
    page.get_by_role("region", name="Faults").get_by_text("A valve pushes that nobody opened").wait_for()
    assert shown_s(page) > 3.0


def test_nothing_can_be_asked_of_a_recording(opened, served):
    page = opened(served.address)
    page.get_by_role("button", name="STOP").click()
    page.get_by_text("a recording: there is nothing to stop").wait_for()
    assert page.get_by_role("button", name="Arm", exact=True).count() == 0
