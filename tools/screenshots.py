"""Take the pictures of the operator's console and of the terminal view that the documentation shows.

Two emulated flights: one live with its console, one of a scenario in virtual time whose recording the console
shows. Chromium without a screen looks at both; the terminal view is written by rich.

    .venv/bin/python tools/screenshots.py              # all, into docs/pictures
    .venv/bin/python tools/screenshots.py --only recording --out try/pictures

Needs the extra `tests` (Playwright), Chromium and a machine that has nothing else to do: the faults of a
loaded one would be in the pictures. Takes three minutes. Run it when the console has changed, and look at
every picture.
"""

import argparse
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright
from playwright.sync_api import Error as PageError
from rich.console import Console

from groundstation.cli.console_option import FIRST_PORT, HOST, console_access
from groundstation.cli.terminal_view import TerminalView
from groundstation.console.options import attendant
from groundstation.launch.live_run import LiveRun
from groundstation.rig.read import parse_rig, read_text

ROOT = Path(__file__).parents[1]
RIG = ROOT / "examples" / "rigs" / "two_mock_ups_drawn.toml"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SIZES = {"laptop": (1366, 768), "phone": (390, 844)}
STEP_S, READY_MS, LOOK_MS, RETRY_MS = 0.25, 200_000, 4_000, 200
FROM_END_S = 5.5
"""Of the recording: soon after a picture that was asked for came."""
GOAL = "{ x_m = 0.1, y_m = 0.5, heading_deg = 60.0 }"
SCENARIO = f"""
name = "pictures for the documentation"
rig = "{ROOT / "examples" / "rigs" / "two_mock_ups.toml"}"
duration_s = 16.0
ready_s = 60.0
timeline = [
    {{ at_s = 1.0, vehicle = "alpha", request = "go_to", arguments = {GOAL} }},
    {{ at_s = 8.0, vehicle = "alpha", failure = "false_lights", parameters = {{ count = 6 }}, for_s = 5.0 }},
    {{ at_s = 10.0, vehicle = "alpha", request = "picture" }},
    {{ at_s = 13.0, vehicle = "alpha", failure = "wrong_fixes", for_s = 0.1 }},
]
limits = [{{ what = "least_edge_mm", vehicle = "alpha", above = 100.0 }}]
"""
COLUMNS, LINES = 110, 56
TERMINAL_SVG = """<svg class="rich-terminal" viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg">
<style>.{unique_id}-matrix {{ font-family: monospace; font-size: {char_height}px;
line-height: {line_height}px; }} {styles}</style><defs><clipPath id="{unique_id}-clip-terminal">
<rect x="0" y="0" width="{terminal_width}"
height="{terminal_height}"/></clipPath>{lines}</defs>
<rect width="{width}" height="{height}" rx="8" fill="#292929"/>
<g transform="translate({terminal_x}, {terminal_y})" clip-path="url(#{unique_id}-clip-terminal)">{backgrounds}
<g class="{unique_id}-matrix">{matrix}</g></g></svg>
"""  # rich's own asks another host for a typeface
WORDS = "[...document.querySelectorAll('.vehicle .words')]"
ALL_FLY = f"() => {WORDS}.length > 1 && {WORDS}.every((each) => each.textContent.startsWith('flying'))"


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
        open_when_served(page, self._address)
        page.wait_for_function("() => document.getElementById('connection').textContent === 'live'")
        page.get_by_role("tab", name=screen).click()
        return page

    def keep(self, page: Page, name: str) -> None:
        """Write a picture and close its page."""
        path = self._folder / f"{name}.png"
        page.screenshot(path=path)
        page.context.close()
        print(f"{path}", flush=True)


def open_when_served(page: Page, address: str) -> None:
    """Open a page whose server may have printed its address before it listens."""
    until_s = time.monotonic() + READY_MS / 1000
    while True:
        try:
            page.goto(address)
            return
        except PageError:
            if time.monotonic() > until_s:
                raise
            page.wait_for_timeout(RETRY_MS)


def photograph_flight(camera: Photographer) -> None:
    """Screens of a flight that goes on."""
    table = camera.open("Table")
    table.wait_for_function(ALL_FLY, timeout=READY_MS)
    take_control(table)
    fly_to(table, "alpha", (0.1, 0.6, 60.0))
    dark, phone, health = (
        camera.open("Table", scheme="dark"),
        camera.open("Table", "phone"),
        camera.open("Health"),
    )
    health.wait_for_function("() => document.getElementById('health').childElementCount > 0")
    health.wait_for_timeout(LOOK_MS)
    camera.keep(table, "console_table")
    camera.keep(dark, "console_table_dark")
    camera.keep(phone, "console_phone")
    camera.keep(health, "console_health")


def photograph_recording(camera: Photographer) -> None:
    """Screens over a recording."""
    for screen, name in (
        ("Charts", "console_charts"),
        ("Camera", "console_camera"),
        ("Table", "console_replay"),
    ):
        page = camera.open(screen)
        page.wait_for_function("() => document.querySelector('#replay input')")
        page.evaluate(
            "(t) => { const bar = document.querySelector('#replay input'); bar.value = Number(bar.max) - t;"
            " bar.dispatchEvent(new Event('input')); bar.dispatchEvent(new Event('change')); }",
            FROM_END_S,
        )
        page.wait_for_timeout(LOOK_MS)
        camera.keep(page, name)


def take_control(page: Page) -> None:
    """As an operator does."""
    page.get_by_role("button", name="As …").click()
    page.get_by_label("Your name").fill("anna")
    page.get_by_role("button", name="Take it").click()
    page.wait_for_function(
        "() => document.getElementById('lease').textContent.startsWith('you hold control')"
    )


def fly_to(page: Page, vehicle: str, goal: tuple[float, float, float]) -> None:
    """Type a goal (m, m, deg) and send it."""
    card = page.get_by_role("region", name=vehicle, exact=True)
    for field, value in zip(card.locator("form input").all(), goal, strict=True):
        field.fill(str(value))
    card.get_by_role("button", name="Go to").click()
    page.get_by_role("region", name="Flown ahead").get_by_role("button", name="Send").click()


def shoot(address: str, folder: Path, take: Callable[[Photographer], None]) -> None:
    """Open Chromium on a console."""
    path = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        try:
            take(Photographer(browser, address, folder))
        finally:
            browser.close()


def take_flight(folder: Path, scratch: Path) -> None:
    """Fly live; the browser has a thread of its own, since the launcher wants the main one."""
    text = read_text(RIG, "rig")
    access = console_access(HOST, FIRST_PORT, None)
    terminal = Console(record=True, width=COLUMNS, height=LINES, file=io.StringIO(), force_terminal=True)
    live = LiveRun(parse_rig(text, RIG), text, RIG, scratch / "run.mcap", attendants=[attendant(access)])
    view = TerminalView(live, terminal)
    svg = ""
    with ThreadPoolExecutor(1) as browser:
        try:
            live.start(lambda: False)
            shooting = None
            with view.opened(headless=False, keys="space stops all   l lands all   q ends"):
                while shooting is None or not shooting.done():
                    live.step(STEP_S)
                    live.check_start()
                    if shooting is None and live.is_ready and live.launcher.greetings:
                        shooting = browser.submit(shoot, access.address, folder, photograph_flight)
                terminal.export_text()  # forgets what was drawn before
                view.refresh()
                svg = terminal.export_svg(title="", code_format=TERMINAL_SVG)
            shooting.result()
        finally:
            live.close()
    (folder / "terminal_view.svg").write_text(svg, encoding="utf-8")
    print(folder / "terminal_view.svg")


def take_recording(folder: Path, scratch: Path) -> None:
    """Fly in virtual time, and open the console over the recording."""
    command = [sys.executable, "-m", "groundstation"]
    scenario, recording = scratch / "pictures.toml", scratch / "pictures.mcap"
    scenario.write_text(SCENARIO, encoding="utf-8")
    subprocess.run([*command, "run", scenario, "--lockstep", "--record", recording], check=True)
    with subprocess.Popen([*command, "console", recording], stdout=subprocess.PIPE, text=True) as serving:
        assert serving.stdout is not None
        try:
            found = re.search(r"http://\S+", serving.stdout.readline())
            if found is None:
                raise RuntimeError("the console printed no address")
            shoot(found[0], folder, photograph_recording)
        finally:
            serving.terminate()


KINDS = {"recording": take_recording, "flight": take_flight}


def main() -> int:
    """Fly, look, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=Path, default=ROOT / "docs" / "pictures", help="Folder of the pictures."
    )
    parser.add_argument("--only", choices=KINDS, help="Of one flight.")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    if not any(map(shutil.which, BROWSERS)):
        print(
            "screenshots: there is no Chromium on this machine (Debian: apt install chromium)",
            file=sys.stderr,
        )
        return 2
    with tempfile.TemporaryDirectory() as scratch:
        os.environ.update(XDG_RUNTIME_DIR=scratch, XDG_STATE_HOME=f"{scratch}/state")
        for kind, take in KINDS.items():
            if asked.only in (None, kind):
                take(asked.out, Path(scratch))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
