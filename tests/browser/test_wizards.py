"""A guided calibration as an operator meets it: what to do, what is seen, the result, accept or discard."""

import tomllib
from pathlib import Path

import pytest
from oracles.slow_guide import MeanWizard
from oracles.wizard_console import ServedConsole

from groundstation.console import wizards
from groundstation.rig.read import load_rig

pytestmark = pytest.mark.slow
RIG = Path(__file__).parents[2] / "examples" / "rigs" / "two_mock_ups_drawn.toml"
S = 1000
HEADING = "() => document.querySelector('.wizard h2')?.textContent.includes(%r)"
NOTICE = "() => /%s/i.test(document.getElementById('notice').textContent)"
STEP = "() => document.querySelector('.wizard-instruction')?.textContent === %r"


@pytest.fixture
def served(tmp_path, monkeypatch):
    """A console whose only wizard takes the mean of 60 states."""
    wizard = MeanWizard(60)
    monkeypatch.setattr(wizards, "wizard_names", lambda: ("mean",))
    monkeypatch.setattr(wizards, "load_wizard", lambda name: wizard)
    console = ServedConsole(load_rig(RIG), tmp_path / "run.mcap")
    yield console
    console.close()


def take_control(page, name="anna"):
    page.get_by_role("button", name="As …").click()
    page.get_by_label("Your name").fill(name)
    page.get_by_role("button", name="Take it").click()
    page.wait_for_function("() => document.getElementById('lease').textContent.startsWith('you hold')")


@pytest.mark.parametrize(("size", "scheme"), [("phone", "light"), ("tablet", "dark"), ("laptop", "light")])
def test_it_is_followed_judged_and_accepted(opened, served, tmp_path, size, scheme):
    page = opened(served.address, size, scheme)
    page.get_by_role("tab", name="Wizards").click()
    card = page.get_by_role("region", name="mean", exact=True)
    card.get_by_role("button", name="Start").click()
    page.wait_for_function(NOTICE % "take control")
    take_control(page)
    card.get_by_role("button", name="Start").click()
    page.wait_for_function(HEADING % "mean of alpha: Going on", timeout=20 * S)
    page.wait_for_function(STEP % "Let it stand.", timeout=20 * S)
    assert card.get_by_role("button", name="Start").is_disabled()
    picture = page.get_by_role("img", name="What came: x,")
    picture.wait_for(timeout=20 * S)
    page.wait_for_function(STEP % "Let it stand on.", timeout=20 * S)
    page.screenshot(path=tmp_path / f"collecting_{size}.png")
    page.wait_for_function(HEADING % "Result: accept or discard", timeout=30 * S)
    text = page.get_by_role("region", name="Guided calibration").inner_text()
    assert "Verified by" in text
    assert "states more" in text
    assert "collect: enough data" in text
    page.screenshot(path=tmp_path / f"result_{size}.png")
    assert not (tmp_path / "calibrations").exists()
    assert not page.evaluate("document.documentElement.scrollWidth > innerWidth + 1")
    axe = pytest.importorskip("axe_core_python.sync_playwright")
    found = axe.Axe().run(page)["violations"]
    assert not [row["id"] for row in found if row["impact"] in ("serious", "critical")]
    page.get_by_role("button", name="Accept").click()
    page.wait_for_function(HEADING % "Accepted", timeout=20 * S)
    (path,) = (tmp_path / "calibrations").glob("alpha_mean_*.toml")
    assert str(path) in page.get_by_role("region", name="Guided calibration").inner_text()
    assert tomllib.loads(path.read_text())["mean"]["value"] == 0.25
    assert served.desk.asked[0] == ("alpha", "land", {}, "anna")  # driven, in the holder's name


def test_discarded_it_leaves_nothing_and_whoever_looks_on_sees_the_same(opened, served, tmp_path):
    page, other = opened(served.address), opened(served.address, "tablet")
    for each in (page, other):
        each.get_by_role("tab", name="Wizards").click()
    take_control(page)
    card = page.get_by_role("region", name="mean", exact=True)
    card.get_by_label("it flies by itself").uncheck()
    card.get_by_role("button", name="Start").click()
    for each in (page, other):
        each.wait_for_function(HEADING % "Result: accept or discard", timeout=40 * S)
    other.get_by_role("button", name="Accept").click()  # without control
    other.wait_for_function(NOTICE % "take control")
    page.get_by_role("button", name="Discard").click()
    for each in (page, other):
        each.wait_for_function("() => document.querySelector('.wizard').hidden")
    assert not list(tmp_path.glob("calibrations/*"))
    assert not served.desk.asked
    late = opened(served.address, "phone")
    late.get_by_role("tab", name="Wizards").click()
    assert late.get_by_role("region", name="mean", exact=True).is_visible()
