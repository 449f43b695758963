"""The console beside a flight: what it serves, the lease, the stop, and that a flight does not need it."""

import os
import re
import signal

import httpx2 as httpx
import pytest

pytestmark = pytest.mark.slow


@pytest.fixture
def flight(launch, two_drawn):
    run = launch(two_drawn, has_console=True)
    line = run.wait_for("console: http://127.0.0.1:")
    run.address = re.search(r"http://\S+", line)[0]
    run.rewind()  # on a busy machine they fly before the console is ready
    run.wait_until_flying()
    return run


@pytest.fixture
def web(flight):
    retries = httpx.HTTPTransport(retries=5)
    with httpx.Client(base_url=flight.address, timeout=10.0, transport=retries) as client:
        wait_for_answer(client)
        yield client


def wait_for_answer(client, most=2000):
    """The state, as soon as the console answers and has received something."""
    for _ in range(most):
        try:
            found = client.get("/api/state").json()
        except httpx.TransportError:
            continue
        if all(vehicle.get("mode") == "flying" for vehicle in found["vehicles"].values()):
            return found
    raise AssertionError("the console never showed two flying vehicles")


def take(web, name="anna"):
    answer = web.post("/api/lease", json={"action": "take", "name": name}).json()
    assert answer["accepted"], answer
    return answer["token"]


def test_it_shows_both_vehicles_and_sends_requests_under_the_lease(flight, web):
    state = web.get("/api/state").json()
    assert abs(state["vehicles"]["alpha"]["x_m"] + 0.6) < 0.1
    assert 0 <= state["vehicles"]["alpha"]["age_s"] < 5
    goal = {"vehicle": "alpha", "action": "go_to", "arguments": {"x_m": -0.5, "y_m": 0.1, "heading_rad": 0.0}}
    refused = web.post("/api/request", json=goal)
    assert refused.status_code == 403
    assert "take control" in refused.json()["reason"]
    token = take(web)
    assert web.post("/api/request", json={**goal, "token": token}).json()["accepted"]
    far = {**goal, "arguments": {"x_m": 50.0, "y_m": 0.0, "heading_rad": 0.0}, "token": token}
    assert not web.post("/api/request", json=far).json()["accepted"]
    wrong = {**goal, "arguments": {"x_m": "here"}, "token": token}
    assert web.post("/api/request", json=wrong).status_code == 400
    other = web.post("/api/lease", json={"action": "take", "name": "bert"})
    assert other.status_code == 409
    assert "anna" in other.json()["reason"]
    same_name = web.post("/api/lease", json={"action": "take", "name": "anna"})
    assert same_name.status_code == 409
    assert web.post("/api/lease", json={"action": "pass_on", "to": "bert", "token": token}).json()["accepted"]
    assert web.post("/api/request", json={**goal, "token": token}).status_code == 403
    assert take(web, "bert")


def test_a_stop_needs_no_token_and_each_call_is_a_press(flight, web):
    first = web.post("/api/stop").json()
    assert first["accepted"], first
    assert set(first["stopped"]) == {"alpha", "beta"}
    again = web.post("/api/stop").json()
    assert again["accepted"]
    state = web.get("/api/state").json()
    assert all(vehicle["stop_latched"] for vehicle in state["vehicles"].values())
    for name in ("alpha", "beta"):
        flight.rewind()
        flight.wait_for(f"{name}: stopped", "by console")


def test_a_console_that_is_killed_comes_back_and_the_flight_does_not_notice(flight, web):
    token = take(web)
    flight.forget()
    for _ in range(2):
        os.kill(flight.pids()["console"], signal.SIGKILL)
        flight.wait_for("console was ended by SIGKILL; starting it again")
        state = wait_for_answer(web)
        assert all(vehicle["mode"] == "flying" for vehicle in state["vehicles"].values())
    goal = {"vehicle": "beta", "action": "go_to", "arguments": {"x_m": 0.5, "y_m": 0.1, "heading_rad": 0.0}}
    assert web.post("/api/request", json={**goal, "token": token}).json()["accepted"]
    os.kill(flight.pids()["console"], signal.SIGSTOP)
    flight.wait_for("console hangs")
    wait_for_answer(web)
    assert not any("LANDED" in line for line in flight.lines)
    flight.end_in_order()


def test_a_goal_is_flown_ahead(flight, web):
    goal = {"vehicle": "alpha", "action": "go_to", "arguments": {"x_m": -0.4, "y_m": 0.2, "heading_rad": 0.0}}
    shown = web.post("/api/preview", json=goal, timeout=90).json()
    assert not shown["refused"], shown
    *_, last = shown["paths"]["alpha"]
    assert abs(last[1] + 0.4) < 0.03
    assert abs(last[2] - 0.2) < 0.03
    assert shown["figures"]["gas_ns"] > 0
    assert web.post("/api/preview", json={**goal, "vehicle": "nobody"}).status_code == 400


def test_a_note_is_recorded(flight, web):
    assert web.post("/api/marker", json={"text": "lamp switched off"}).json()["accepted"]
    assert web.post("/api/marker", json={"text": "two\nlines"}).status_code == 400


def test_two_runs_have_two_ports(launch, two_drawn, flight):
    other = launch(two_drawn, has_console=True)
    line = other.wait_for("console: http://127.0.0.1:")
    assert re.search(r"http://\S+", line)[0] != flight.address
