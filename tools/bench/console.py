"""The web console beside two mock-ups: what it costs, how old a picture is, and how fast the stop is.

Screens are WebSockets that read, and one Chromium without a screen where there is one. The browser's clock is
laid over the host's by the quickest of some requests, as NTP does.
"""

import json
import re
import shutil
import socket
import time
from pathlib import Path
from typing import Any

import numpy as np
from websockets.sync.client import connect

from bench.flying import Flying, flying
from bench.processes import children, read, words_of
from bench.rows import RIGS, Bench, Row
from bench.stop import ages_ms

RIG = RIGS / "two_mock_ups_drawn.toml"
SPAN_S, STALLED_S = 20.0, 60.0
PRESSES, FRAMES = 20, 200
CPU_ONE, CPU_FIVE = 0.06, 0.15
DRAWN_MS, LOAD_S, WEIGHT_KB, TAP_MS = 120.0, 1.0, 400, 60.0
MEMORY_MB = 8.0
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_TICK_S = 0.01

_DRAWN = """async (count) => {
  let best = null;
  for (let i = 0; i < 30; i++) {
    const before = performance.now();
    const state = await (await fetch('/api/state')).json(), after = performance.now();
    const offset = state.now_ns * 1e-6 - (before + after) / 2;
    if (!best || after - before < best[0]) best = [after - before, offset];
  }
  const ages = [];
  let last = 0;
  while (ages.length < count) {
    await new Promise(requestAnimationFrame);
    const stamp = window.shownStamp ?? 0;
    if (stamp !== last) { last = stamp; ages.push(performance.now() + best[1] - stamp * 1e-6); }
  }
  return ages;
}"""
"""Ages of the newest state at the frame after it was drawn, ms."""


def measure(bench: Bench) -> list[Row]:
    """Fly, look on, stall, stop."""
    path = bench.folder / "console.mcap"
    rows: list[Row] = []
    with flying(bench, RIG, "--record", str(path)) as flight:
        address = _address(flight)
        flight.wait_for(r"(\w+): flying", {"alpha", "beta"})
        console = next(
            pid for pid in children(flight.process.pid) if words_of(pid)[:1] == ["groundstation console"]
        )
        rows += _costs(bench, console, address)
        rows.append(_stalled(bench, console, address))
        rows += _in_a_browser(bench, address)
    taps = ages_ms(path, first_only=False)
    if taps:
        p50, p99 = np.percentile(taps, (50, 99))
        rows.append(
            Row(
                "STOP tapped in the browser to the first CAN frame that carries it, p99",
                f"{TAP_MS:g} ms, aim 30",
                f"{p99:.1f} ms from the press published (p50 {p50:.1f} ms, {len(taps)} frames)",
                bool(p99 <= TAP_MS),
            )
        )
    return rows


def _address(flight: Flying) -> str:
    return flight.wait_for(r"console: (http\S+)")


def _costs(bench: Bench, console: int, address: str) -> list[Row]:
    rows = []
    for count, limit, aim in ((0, None, None), (1, CPU_ONE, 0.03), (5, CPU_FIVE, 0.08)):
        bench.say(f"console: {count} screens")
        screens = [_Screen(address) for _ in range(count)]
        began_s, until_s = _cpu_s(console), time.monotonic() + SPAN_S
        while time.monotonic() < until_s:
            for screen in screens:
                screen.read()
            time.sleep(0.01)
        cores = (_cpu_s(console) - began_s) / SPAN_S
        rates = ", ".join(f"{screen.states / SPAN_S:.0f}" for screen in screens)
        for screen in screens:
            screen.close()
        rows.append(
            Row(
                f"console server, two mock-ups, {count} screens",
                "" if limit is None else f"{limit:g} core, aim {aim:g}",
                f"{cores:.3f} core{f' ({rates} states/s)' if rates else ''}",
                None if limit is None else cores <= limit,
            )
        )
    return rows


def _stalled(bench: Bench, console: int, address: str) -> Row:
    """A screen that never reads, beside one that does."""
    bench.say(f"console: a screen that does not read for {STALLED_S:g} s")
    host, port = re.findall(r"//([^:/]+):(\d+)", address)[0]
    with socket.create_connection((host, int(port))) as dead:
        dead.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        dead.sendall(
            f"GET /ws HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        screen, before_mb, worst_s = _Screen(address), _rss_mb(console), 0.0
        until_s = time.monotonic() + STALLED_S
        while time.monotonic() < until_s:
            worst_s = max(worst_s, screen.read())
            time.sleep(0.01)
        grown_mb = _rss_mb(console) - before_mb
        screen.close()
    return Row(
        f"one screen unread for {STALLED_S:g} s: longest gap of another one; memory",
        f"none; bounded ({MEMORY_MB:g} MB)",
        f"{1000 * worst_s:.0f} ms; {grown_mb:+.1f} MB",
        worst_s < 1.0 and grown_mb < MEMORY_MB,
    )


def _in_a_browser(bench: Bench, address: str) -> list[Row]:
    path = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if path is None:
        return [Row("in a browser", "", "no Chromium on this machine", None)]
    from playwright.sync_api import sync_playwright

    bench.say("console: in Chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1024, "height": 768})
        began_s = time.monotonic()
        page.goto(address)
        page.wait_for_function("() => document.getElementById('connection').textContent === 'live'")
        load_s = time.monotonic() - began_s
        sizes = page.evaluate("performance.getEntriesByType('resource').map((e) => e.encodedBodySize)")
        weight_kb = (sum(sizes) + len(page.content())) / 1000
        ages = np.array(page.evaluate(_DRAWN, FRAMES))
        for _ in range(PRESSES):
            _press(page)
        browser.close()
    p50, p95 = np.percentile(ages, (50, 95))
    return [
        Row("state on the bus to pixels, headless Chromium, p95", f"{DRAWN_MS:g} ms, aim 70",
            f"{p95:.0f} ms (p50 {p50:.0f} ms)", bool(p95 <= DRAWN_MS)),
        Row("page load to live on loopback", f"{LOAD_S:g} s, aim 0.4", f"{load_s:.2f} s", load_s <= LOAD_S),
        Row("page weight", f"{WEIGHT_KB} kB, aim 250", f"{weight_kb:.0f} kB", weight_kb <= WEIGHT_KB),
    ]  # fmt: skip


def _wait_for_words(page: Any, condition: str) -> None:  # noqa: ANN401 of Playwright
    every = "() => [...document.querySelectorAll('.vehicle .words')].every((each) => %s)"
    page.wait_for_function(every % condition)


def _press(page: Any) -> None:  # noqa: ANN401 of Playwright
    page.get_by_role("button", name="STOP").click()
    _wait_for_words(page, "each.textContent.startsWith('stopped')")  # only then it can be released
    page.evaluate(
        """async () => {
          const post = async (path, body) => (await fetch(path, {method: 'POST',
            headers: {'Content-Type': 'application/json'}, body: JSON.stringify(body)})).json();
          const token = window.benchToken ?? '';
          const lease = await post('/api/lease', {action: 'take', name: 'bench', token});
          window.benchToken = lease.token ?? window.benchToken;
          for (const vehicle of ['alpha', 'beta'])
            await post('/api/request', {vehicle, action: 'release', token: window.benchToken});
        }"""
    )
    _wait_for_words(page, "!each.textContent.includes('latched')")


class _Screen:
    """A screen that reads whatever comes."""

    def __init__(self, address: str) -> None:
        self._socket = connect(address.replace("http", "ws") + "ws", max_size=None)
        self.states = 0
        self._last_s = time.monotonic()

    def read(self) -> float:
        """Read what has come; seconds since the last state."""
        while True:
            try:
                frame = self._socket.recv(timeout=0)
            except TimeoutError:
                return time.monotonic() - self._last_s
            if frame[:1] == b"J" and json.loads(frame[1:])["type"] == "state":
                self.states += 1
                self._last_s = time.monotonic()

    def close(self) -> None:
        self._socket.close()


def _cpu_s(pid: int) -> float:
    fields = read(pid, "stat").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * _TICK_S


def _rss_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096e-6
