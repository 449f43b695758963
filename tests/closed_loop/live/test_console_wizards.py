"""A guided calibration led by the console of a real run: who may, what it asks for, how a stop ends it."""

import re
import time

import httpx2 as httpx
import pytest

pytestmark = pytest.mark.slow
LONGEST_S = 90.0


@pytest.fixture
def web(launch, two_drawn):
    run = launch(two_drawn, has_console=True)
    run.wait_until_flying()
    run.rewind()
    line = run.wait_for("console: http://127.0.0.1:")
    with httpx.Client(base_url=re.search(r"http://\S+", line)[0], timeout=20.0) as client:
        yield client


def until(web, is_so):
    """What the console shows of it, as soon as something is so."""
    until_s = time.monotonic() + LONGEST_S
    while time.monotonic() < until_s:
        page = web.get("/api/wizard").json()
        if is_so(page):
            return page
    raise AssertionError(page["session"] and {**page["session"], "pictures": "…"})


def test_it_is_led_in_the_holders_name_and_ends_when_somebody_stops(web):
    wizards = {row["name"]: row for row in until(web, lambda page: page["wizards"])["wizards"]}
    assert set(wizards) >= {"imu", "lens", "motion_capture", "mount", "survey", "valves"}
    assert wizards["valves"]["missing"] == {"alpha": "", "beta": ""}
    assert wizards["mount"]["missing"]["alpha"] == "it has no star camera"
    start = {"action": "start", "name": "valves", "vehicle": "alpha", "drive": True}
    assert web.post("/api/wizard", json=start).status_code == 403
    token = web.post("/api/lease", json={"action": "take", "name": "anna"}).json()["token"]
    for wrong in ({"name": "mount"}, {"name": "hull"}, {"vehicle": "gamma"}, {"action": "stop"}):
        answer = web.post("/api/wizard", json={**start, **wrong, "token": token})
        assert answer.status_code == 400, wrong
        assert answer.json()["reason"]
    assert web.post("/api/wizard", json={**start, "token": token}).json()["accepted"]
    assert web.post("/api/wizard", json={**start, "token": token}).status_code == 403  # one at a time
    # it flew: the wizard lands it for the rest, and lets it fly again
    page = until(web, lambda page: "rest: enough data" in page["session"]["lines"])
    assert page["session"]["author"] == "anna"
    page = until(web, lambda page: any(c["x"] for p in page["session"]["pictures"] for c in p["curves"]))
    until(web, lambda _: web.get("/api/state").json()["vehicles"]["alpha"]["mode"] == "flying")
    assert web.post("/api/wizard", json={"action": "accept", "token": token}).status_code == 403
    web.post("/api/stop", json={"vehicle": "alpha"})
    page = until(web, lambda page: page["session"]["state"] == "ended")
    assert "was stopped" in page["session"]["trouble"]
    assert web.post("/api/wizard", json={"action": "discard", "token": token}).json()["accepted"]
    assert web.get("/api/wizard").json()["session"] is None
