"""Take the pictures of the operator's console and of the terminal view that the documentation shows.

An emulated flight, its console in Chromium without a screen, and the terminal view written by rich:

    .venv/bin/python tools/screenshots.py              # all, into docs/pictures
    .venv/bin/python tools/screenshots.py --out try    # somewhere else

Needs the extra `tests` (Playwright) and Chromium. Takes three minutes; run it when the pages of the console have
changed, and look at every picture.
"""

import argparse
import io
import os
import shutil
import sys
import tempfile
import threading
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright
from rich.console import Console

from groundstation.cli.console_option import FIRST_PORT, HOST, console_access
from groundstation.cli.terminal_view import TerminalView
from groundstation.console.options import attendant
from groundstation.launch.live_run import LiveRun
from groundstation.rig.read import parse_rig, read_text

ROOT = Path(__file__).parents[1]
RIG = ROOT / "examples" / "rigs" / "two_mock_ups.toml"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SIZES = {"laptop": (1366, 768), "phone": (390, 844)}
STEP_S, READY_MS, LOOK_MS = 0.25, 120_000, 4_000
COLUMNS, LINES = 110, 34
TERMINAL_SVG = """<svg class="rich-terminal" viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg">
<style>.{unique_id}-matrix {{ font-family: monospace; font-size: {char_height}px; line-height: {line_height}px; }}
{styles}</style><defs><clipPath id="{unique_id}-clip-terminal"><rect x="0" y="0" width="{terminal_width}"
height="{terminal_height}"/></clipPath>{lines}</defs>
<rect width="{width}" height="{height}" rx="8" fill="#292929"/>
<g transform="translate({terminal_x}, {terminal_y})" clip-path="url(#{unique_id}-clip-terminal)">{backgrounds}
<g class="{unique_id}-matrix">{matrix}</g></g></svg>
"""  # rich's own asks another host for a typeface
ALL = "() => [...document.querySelectorAll('.vehicle .words')].length > 1 && [...document.querySelectorAll('.vehicle .words')].every((each) => %s)"


class Photographer:
    """Opens the console's screens and keeps what they look like.

    Args:
        browser: Chromium.
        address: Of the console.
        folder: Where pictures go.
    """

    def __init__(self, browser: Browser, address: str, folder: Path) -> None:
        self._browser = browser
        self._address = address
        self._folder = folder

    def open(self, screen: str, size: str = "laptop", scheme: str = "light") -> Page:
        """A page of its own, on one screen of the console."""
        width, height = SIZES[size]
        context = self._browser.new_context(
            viewport={"width": width, "height": height},
            color_scheme="dark" if scheme == "dark" else "light",
            has_touch=size == "phone",
        )
        page = context.new_page()
        page.goto(f"{self._address}#{screen}")
        page.wait_for_function("() => document.getElementById('connection').textContent === 'live'")
        return page

    def keep(self, page: Page, name: str) -> None:
        """Write a picture and close its page."""
        path = self._folder / f"{name}.png"
        page.screenshot(path=path)
        page.context.close()
        print(f"{path}", flush=True)


def photograph(browser: Browser, address: str, folder: Path) -> None:
    """All screens of a flight."""
    camera = Photographer(browser, address, folder)
    table = camera.open("table")
    charts = camera.open("charts")
    table.wait_for_function(ALL % "each.textContent.startsWith('flying')", timeout=READY_MS)
    take_control(table)
    fly_to(table, "alpha", (0.1, 0.5, 60.0))
    table.wait_for_timeout(LOOK_MS)
    camera.keep(camera.open("table", scheme="dark"), "console_table_dark")
    camera.keep(table, "console_table")
    charts.wait_for_timeout(LOOK_MS)
    camera.keep(charts, "console_charts")
    star = camera.open("camera")
    star.wait_for_function("() => !document.getElementById('camera-words').textContent.startsWith('No picture')")
    camera.keep(star, "console_camera")
    for name, scheme in (("console_health", "light"), ("console_health_dark", "dark")):
        health = camera.open("health", scheme=scheme)
        health.wait_for_function("() => document.getElementById('health').childElementCount > 0")
        camera.keep(health, name)
    phone = camera.open("table", "phone")
    phone.wait_for_timeout(LOOK_MS)
    camera.keep(phone, "console_phone")


def take_control(page: Page) -> None:
    """As an operator does."""
    page.get_by_role("button", name="Take control").click()
    page.get_by_label("Your name").fill("anna")
    page.get_by_role("button", name="Take it").click()
    page.wait_for_function(
        "() => document.getElementById('lease').textContent.startsWith('you hold control')"
    )


def fly_to(page: Page, vehicle: str, goal: tuple[float, float, float]) -> None:
    """Type a goal (m, m, deg), wait until it was flown ahead, and send it."""
    card = page.get_by_role("region", name=vehicle, exact=True)
    for field, value in zip(card.locator("form input").all(), goal, strict=True):
        field.fill(str(value))
    card.get_by_role("button", name="Go to").click()
    plan = page.get_by_role("region", name="Flown ahead")
    plan.get_by_text("settled after").wait_for(timeout=READY_MS)
    plan.get_by_role("button", name="Send").click()


def shoot(address: str, folder: Path, outcome: list[BaseException | None], is_over: threading.Event) -> None:
    """What the thread of the browser does: the flight has the main one."""
    path = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
            photograph(browser, address, folder)
            browser.close()
    except BaseException as error:  # noqa: BLE001  # reported by the main thread
        outcome.append(error)
    finally:
        is_over.set()


def main() -> int:
    """Fly, look, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "pictures", help="Folder of the pictures.")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    if not any(map(shutil.which, BROWSERS)):
        print("screenshots: there is no Chromium on this machine (Debian: apt install chromium)", file=sys.stderr)
        return 2
    text = read_text(RIG, "rig")
    access = console_access(HOST, FIRST_PORT, None)
    terminal = Console(record=True, width=COLUMNS, height=LINES, file=io.StringIO(), force_terminal=True)
    outcome: list[BaseException | None] = []
    is_over = threading.Event()
    with tempfile.TemporaryDirectory() as scratch:
        os.environ.update(XDG_RUNTIME_DIR=scratch, XDG_STATE_HOME=f"{scratch}/state")
        live = LiveRun(
            parse_rig(text, RIG), text, RIG, Path(scratch) / "run.mcap", attendants=[attendant(access)]
        )
        view = TerminalView(live, terminal)
        try:
            live.start(lambda: False)
            thread = None
            with view.opened(headless=False, keys="space stops all   l lands all   q ends"):
                while not is_over.is_set():
                    live.step(STEP_S)
                    live.check_start()
                    if live.is_ready and thread is None and live.launcher.greetings:
                        arguments = (access.address, folder, outcome, is_over)
                        thread = threading.Thread(target=shoot, args=arguments)
                        thread.start()
                terminal.export_text()  # what was drawn before
                view.refresh()
                svg = terminal.export_svg(title="", code_format=TERMINAL_SVG, clear=True)
        finally:
            live.close()
    if outcome:
        print(f"screenshots: {outcome[0]}", file=sys.stderr)
        return 1
    (folder / "terminal_view.svg").write_text(svg, encoding="utf-8")
    print(folder / "terminal_view.svg")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
