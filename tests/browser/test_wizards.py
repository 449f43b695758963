"""A guided calibration as an operator meets it: what to do, what is seen, the result, accept or discard."""

import json
import tomllib

import pytest

pytestmark = pytest.mark.slow
S = 1000
FLYING_MS, COLLECTED_MS = 90 * S, 280 * S
HEADING = "() => document.querySelector('.wizard h2')?.textContent.includes(%r)"


def wait_for(page, words, timeout_ms):
    page.wait_for_function(HEADING % words, timeout=timeout_ms)


@pytest.fixture
def page(opened, flight):
    found = opened(flight.address, "tablet")
    condition = "Object.values(s.vehicles).every((v) => v.mode === 'flying')"
    found.wait_for_function(
        f"async () => await fetch('/api/state').then((a) => a.json()).then((s) => {condition})",
        timeout=FLYING_MS,
        polling=200,
    )
    found.get_by_role("tab", name="Wizards").click()
    return found


def test_the_valves_of_a_flying_mock_up_are_identified_and_accepted(page, flight):
    card = page.get_by_role("region", name="valves", exact=True)
    assert "thrust" in card.inner_text()
    absent = page.get_by_role("region", name="mount", exact=True)
    assert "it has no star camera" in absent.inner_text()
    card.get_by_role("button", name="Start").click()
    page.wait_for_function("() => /take control/i.test(document.getElementById('notice').textContent)")
    page.get_by_role("button", name="Take control").click()
    page.get_by_label("Your name").fill("anna")
    page.get_by_role("button", name="Take it").click()
    page.wait_for_function("() => document.getElementById('lease').textContent.startsWith('you hold')")
    card.get_by_role("button", name="Start").click()
    wait_for(page, "valves of alpha: Going on", 20 * S)
    page.wait_for_function(
        "() => /hands off/.test(document.querySelector('.wizard-instruction').textContent)"
    )
    assert (
        page.get_by_role("region", name="imu", exact=True).get_by_role("button", name="Start").is_disabled()
    )
    page.wait_for_function(
        "() => /fly to and fro/.test(document.querySelector('.wizard-instruction').textContent)",
        timeout=COLLECTED_MS,
    )
    picture = page.get_by_role("img", name="Each valve over the rig's")
    page.wait_for_function(
        "() => [...document.querySelectorAll('.wizard canvas')].some((c) => "
        "/thrust over mass, [1-8] points/.test(c.getAttribute('aria-label')))",
        timeout=COLLECTED_MS,
    )
    assert picture.is_visible()
    page.screenshot(path=flight.folder / "wizard_collecting.png", full_page=True)
    wait_for(page, "Result: accept or discard", COLLECTED_MS)
    text = page.get_by_role("region", name="Guided calibration").inner_text()
    assert "Verified by a flight of" in text
    assert "valve 0 thrust over mass" in text
    page.screenshot(path=flight.folder / "wizard_result.png", full_page=True)
    assert not (flight.folder / "calibrations").exists()
    page.get_by_role("button", name="Accept").click()
    wait_for(page, "Accepted", 20 * S)
    (path,) = (flight.folder / "calibrations").glob("alpha_valves_*.toml")
    assert str(path) in page.get_by_role("region", name="Guided calibration").inner_text()
    written = tomllib.loads(path.read_text())
    assert written["recording"].startswith("live, rig two_mock_ups_drawn.toml")
    assert written["verification"]["rate"]["value"] < 5e-3
    page.get_by_role("button", name="Close").click()
    page.get_by_role("button", name="Give control").click()
    page.wait_for_function("() => document.getElementById('lease').textContent === 'nobody holds control'")


def test_discarded_it_leaves_nothing_and_the_vehicle_is_still_there(page, flight, api):
    files = set(flight.folder.glob("calibrations/*"))
    page.get_by_role("button", name="Take control").click()
    page.get_by_label("Your name").fill("bert")
    page.get_by_role("button", name="Take it").click()
    page.wait_for_function("() => document.getElementById('lease').textContent.startsWith('you hold')")
    card = page.get_by_role("region", name="imu", exact=True)
    card.get_by_label("it flies by itself").uncheck()
    card.get_by_role("button", name="Start").click()
    wait_for(page, "imu of alpha: Going on", 20 * S)
    page.get_by_role("button", name="Discard").click()
    page.wait_for_function("() => document.querySelector('.wizard').hidden")
    assert set(flight.folder.glob("calibrations/*")) == files
    assert json.dumps(api(page)["vehicles"]["alpha"]["mode"]) in ('"flying"', '"holding"')
