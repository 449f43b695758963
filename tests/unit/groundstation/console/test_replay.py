"""The console over a recording: where it is, what is known there, jumps, charts, another one over it."""

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from groundstation.console.access import Access
from groundstation.console.replay import ReplaySource
from groundstation.console.server import make_app
from groundstation.console.shown_console import Console
from groundstation.console.state import vehicle_state
from groundstation.parts.fusion.messages import VehicleState
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.rig.provenance import recorded_rig

RECORDINGS = Path(__file__).parents[3] / "replay" / "recordings"


@pytest.fixture(scope="module")
def path() -> Path:
    return RECORDINGS / "formation.mcap"


@pytest.fixture
def source(path: Path) -> Iterator[ReplaySource]:
    recording = Recording(path)
    found = ReplaySource(recording, recorded_rig(recording), Recording(path))
    yield found
    found.close()


def states_of(path: Path, vehicle: str) -> list[tuple[int, VehicleState]]:
    with Recording(path) as recording:
        return [
            (message.log_ns, message.payload)  # type: ignore[misc]
            for message in recording.messages([VehicleState], [vehicle])
        ]


@pytest.mark.parametrize("share", [0.0, 0.3, 0.31, 0.9, 1.0, 0.5])
def test_wherever_it_is_moved_to_the_newest_up_to_there_is_shown(
    source: ReplaySource, path: Path, share: float
) -> None:
    vehicle = source.vehicles[0]
    duration_s = source.page["replay"]["duration_s"]
    source.control({"what": "seek", "t_s": share * duration_s})
    now_ns = source.step()
    assert source.place_s == pytest.approx(share * duration_s, abs=1e-6)
    expected = [state for log_ns, state in states_of(path, vehicle) if log_ns <= now_ns]
    shown = vehicle_state(source.feed, vehicle, now_ns)
    if expected:
        assert shown["stamp_ns"] == expected[-1].stamp_ns
        assert shown["x_m"] == expected[-1].position_table_m[0]
    else:
        assert shown["age_s"] is None


def test_latched_messages_of_long_ago_are_known_and_those_to_come_are_not(source: ReplaySource) -> None:
    vehicle = source.vehicles[0]
    source.control({"what": "seek", "t_s": source.page["replay"]["duration_s"]})
    late = vehicle_state(source.feed, vehicle, source.step())
    source.control({"what": "seek", "t_s": 0.0})
    early = vehicle_state(source.feed, vehicle, source.step())
    assert late["mode"]
    assert "mode" not in early or early["mode"] != "flying"


def test_it_plays_by_the_time_that_passes_and_stops_at_the_end(source: ReplaySource) -> None:
    source.control({"what": "seek", "t_s": source.page["replay"]["duration_s"] - 0.001})
    source.control({"what": "play"})
    source.control({"what": "speed", "factor": 100})
    first = source.step()
    while source.extra()["replay"]["is_playing"]:
        source.step()
    assert source.step() >= first
    assert source.place_s == pytest.approx(source.page["replay"]["duration_s"])


def test_the_other_recording_is_laid_over_at_the_same_time(source: ReplaySource) -> None:
    vehicle = source.vehicles[0]
    source.control({"what": "seek", "t_s": 0.8 * source.page["replay"]["duration_s"]})
    now_ns = source.step()
    ghost, own = source.extra()["ghosts"][vehicle], vehicle_state(source.feed, vehicle, now_ns)
    assert math.hypot(ghost[0] - own["x_m"], ghost[1] - own["y_m"]) < 0.01


def test_a_field_comes_whole(source: ReplaySource, path: Path) -> None:
    vehicle = source.vehicles[0]
    name = f"{vehicle}/state.position_table_m[1]"
    times_s, values = source.columns([name])[name]
    expected = [state for _, state in states_of(path, vehicle)]
    assert values.tolist() == [state.position_table_m[1] for state in expected]
    assert times_s[0] == pytest.approx(expected[0].stamp_ns * 1e-9)


@pytest.mark.parametrize("asked", [{"what": "fly"}, {}, {"what": "seek", "t_s": "soon"}, {"what": "speed"}])
def test_what_cannot_be_done_changes_nothing(source: ReplaySource, asked: dict[str, object]) -> None:
    before = source.step()
    with pytest.raises((ValueError, KeyError)):
        source.control(asked)
    assert source.step() == before


def test_it_jumps_to_what_is_looked_for_or_stays(source: ReplaySource) -> None:
    refused = [event for event in source.events.kept if event["kind"] == "fix" and not event["used"]]
    source.control({"what": "seek", "t_s": 0.0})
    before = source.step()
    source.control({"what": "next_refused"})
    if refused:
        assert source.step() == pytest.approx(refused[0]["t_s"] * 1e9, abs=1e3)
    else:
        assert source.step() == before


def test_a_screen_over_a_recording_can_ask_for_nothing(source: ReplaySource) -> None:
    console = Console(source, source.tables, Access())
    with TestClient(make_app(console), base_url="http://127.0.0.1:8400") as client:
        assert client.get("/api/state").json()["replay"]["is_playing"] is False
        assert client.post("/api/stop").status_code == 409
        for path in ("request", "preview", "lease", "marker"):
            found = client.post(f"/api/{path}", json={"vehicle": "alpha", "action": "fly"})
            assert found.status_code == 409
            assert found.json()["reason"].startswith("this is a recording: ")


def test_a_slider_that_asks_hundreds_of_times_costs_one_read(
    source: ReplaySource, monkeypatch: pytest.MonkeyPatch
) -> None:
    source.step()
    reads = []
    read = source._recording.messages

    def counted(*words: object) -> object:
        reads.append(words)
        return read(*words)  # type: ignore[arg-type]

    monkeypatch.setattr(source._recording, "messages", counted)
    last_s = source.page["replay"]["duration_s"]
    for number in range(300):
        source.control({"what": "seek", "t_s": last_s * number / 300})
    assert source.extra()["replay"]["t_s"] == pytest.approx(last_s * 299 / 300)  # it is there at once
    assert reads == []
    source.step()
    source.step()
    assert len(reads) == 1


def test_it_is_played_from_where_it_was_moved_to(source: ReplaySource) -> None:
    half_s = 0.5 * source.page["replay"]["duration_s"]
    source.control({"what": "seek", "t_s": half_s})
    source.control({"what": "play"})
    first_ns, second_ns = source.step(), source.step()
    vehicle = source.vehicles[0]
    assert first_ns < second_ns
    assert source.place_s >= half_s - 1e-6
    assert vehicle_state(source.feed, vehicle, second_ns)["age_s"] < 1.5


@pytest.mark.parametrize("wrong", [math.nan, "nan", "1", None, True, [], {}])
@pytest.mark.parametrize(("what", "name"), [("seek", "t_s"), ("speed", "factor")])
def test_what_is_no_number_moves_nothing(source: ReplaySource, what: str, name: str, wrong: object) -> None:
    with pytest.raises(ValueError, match=f"{name} is .*, expected a number"):
        source.control({"what": what, name: wrong})
    source.control({"what": "play"})
    source.step()


@pytest.mark.parametrize("wild", [1e308, -1e308, math.inf, -math.inf, 10**400, -1])
def test_a_wild_number_means_the_end(source: ReplaySource, wild: float) -> None:
    source.control({"what": "seek", "t_s": wild})
    end_s = source.page["replay"]["duration_s"] if wild > 0 else 0.0
    assert source.place_s == pytest.approx(end_s)
    source.control({"what": "speed", "factor": wild})
    assert source.extra()["replay"]["factor"] == (100.0 if wild > 0 else 0.01)


@pytest.mark.parametrize("asked", [None, {"what": "seek", "t_s": 1.0}])
def test_a_hole_in_the_recording_ends_the_playing_and_no_more(
    source: ReplaySource, monkeypatch: pytest.MonkeyPatch, asked: dict[str, object] | None
) -> None:
    def fails(*_: object) -> None:
        raise RecordingError("a chunk is damaged")

    if asked is None:
        source.step()
    else:
        source.control(asked)
    source.control({"what": "play"})
    monkeypatch.setattr(source, "_read", fails)
    with pytest.raises(RecordingError):
        source.step()
    assert source.step() > 0
    assert not source.extra()["replay"]["is_playing"]
