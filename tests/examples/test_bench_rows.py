"""The parts of ``make bench`` that can be wrong without anybody seeing it in the table."""

import importlib
import json
from pathlib import Path

import pytest

from groundstation.campaign.plan import Plan, columns_of
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.imu.messages import Imu, ImuBytes
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder
from groundstation.rig.read import load_rig
from groundstation.runners.make_runner import make_runner
from groundstation.scenario.loading import load

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("bench") / "run.mcap"
    rig = load_rig(ROOT / "examples" / "rigs" / "drawn_fixes.toml")
    with Recorder(path, RecordingInfo()) as recorder:
        runner = make_runner(rig, 1, [recorder.record])
        runner.run(4_000_000_000)
        runner.close()
    return path


def test_the_journal_leads_from_a_state_back_to_the_bytes_it_was_made_from(bench, recording):
    made_from = bench("journal_of").made_from
    with Recording(recording) as found:
        sample_of = made_from(found, "alpha/fusion", Imu, VehicleState)
        read_of = made_from(found, "alpha/imu_reader", ImuBytes, Imu)
    assert len(sample_of) > 100
    assert all(read_of[sample] for sample in sample_of.values())
    samples = [sample_of[state] for state in sorted(sample_of)]
    assert samples == sorted(samples)


def test_no_frame_is_lost_in_virtual_time(bench, recording):
    with Recording(recording) as found:
        lost, frames = bench("live")._lost(found, "alpha")
    assert lost == 0
    assert frames > 390


def test_the_lock_of_the_benches_pins_the_same_releases_as_the_lock_of_the_tests():
    def pins(name):
        lines = (ROOT / "tools" / name).read_text().splitlines()
        return {line.rstrip("\\ ") for line in lines if line and not line.startswith(" ")}

    assert pins("requirements.lock") < pins("requirements-bench.lock")


def test_the_unit_takes_time(bench):
    assert 0.0 < bench("unit").reference_unit_s() < 10.0


@pytest.mark.parametrize(
    ("flights", "alarms", "shown", "ok"),
    [(0, [], "0, too little was flown", None), (30, [], "0, too little was flown", None),
     (60, [], "0", True), (1, ["pushed"], "1", False)],
)  # fmt: skip
def test_healthy_flights_that_were_not_flown_show_nothing(
    bench, monkeypatch, tmp_path, flights, alarms, shown, ok
):
    module = bench("fault_flights")
    monkeypatch.setattr(module, "FLIGHTS", tmp_path / "none.jsonl")
    monkeypatch.setattr(module, "HEALTHY", tmp_path / "healthy.jsonl")
    row = {"start_s": 10.0, "false_alarms": alarms, "others": []}
    module.HEALTHY.write_text(f"{json.dumps(row)}\n" * flights)
    *promises, healthy = module.measure(None)
    assert all(promise.ok is None for promise in promises)
    assert (healthy.measured, healthy.ok) == (shown, ok)


def test_every_figure_of_formation_flight_is_a_column_of_its_scenario(bench):
    figures = bench("flying_formation").figures()
    subjects = importlib.import_module("formation_flights").SUBJECTS
    assert {figure.subject for figure in figures} <= set(subjects)
    for figure in figures:
        fly = subjects[figure.subject].fly
        if figure.subject == "silence":
            continue
        (path,) = fly.args
        columns = columns_of(load(path), Plan(1, 1))
        assert set(figure.names) <= set(columns), (figure.what, columns)


def test_bounds_of_formation_flight_are_those_of_their_tasks(bench):
    rows = bench("flying_formation")
    assert rows.bang_bang_s() == pytest.approx(10.08, abs=0.02)
    assert rows.least_impulse_n_s() == pytest.approx(1.26, abs=0.01)
    assert rows.least_holding_n_s() == pytest.approx(11.0 * 9.80665 * 5e-4 * 90.0)


def test_a_figure_is_that_of_95_of_100_flights_and_a_missing_one_is_the_worst(bench):
    rows = bench("flying_formation")
    figure = rows.Figure("way", "swap", ("a", "b"), "mm", 10.0, 5.0)
    flights = [{"verdict": "passed", "figures": {"a": 1.0, "b": float(k)}} for k in range(100)]
    row = rows.figure_row(figure, flights)
    assert row.measured.startswith("95 mm (median 49.5, worst 99 of 100)")
    assert row.ok is False
    assert rows.figure_row(figure, flights[:8]).ok is True
    assert rows.figure_row(figure, [{"figures": {"a": 1.0}}]).ok is False
    assert rows.figure_row(figure, []).ok is False
    least = rows.Figure("gap", "swap", ("a", "b"), "mm", 50.0, 80.0, is_least=True)
    assert rows.figure_row(least, [{"figures": {"a": 90.0, "b": 60.0}}]).measured.startswith("60 mm")
    assert rows.figure_row(least, [{"figures": {"a": 90.0, "b": 40.0}}]).ok is False


def test_success_in_too_few_flights_shows_nothing(bench):
    rows = bench("flying_formation")
    success = rows.Success("docks", "dock_still", 97, 100)
    flights = [{"verdict": "passed"}] * 97 + [{"verdict": "failed"}] * 3
    assert rows.success_row(success, flights).ok is True
    assert rows.success_row(success, [*flights[1:], {"verdict": "failed"}]).ok is False
    assert rows.success_row(success, flights[:20]).ok is None
    assert rows.success_row(success, []).ok is False


def test_a_docking_is_judged_by_its_first_contact_and_what_failed_later_is_said(bench):
    rows = bench("flying_formation")
    success = rows.Success("docks", "dock_still", 2, 3, 3, below=rows.SOFT)
    soft = {"beta.contact_speed_mm_s": 8.0, "beta.contact_lateral_mm": 1.0}
    flights = [
        {"verdict": "passed", "figures": soft},
        {"verdict": "failed", "figures": soft},
        {"verdict": "failed", "figures": {**soft, "beta.contact_speed_mm_s": 25.0}},
    ]
    row = rows.success_row(success, flights)
    assert (row.measured, row.ok) == ("2 of 3; 1 of them failed later", True)
    assert (
        rows.success_row(success, [flights[0], flights[2], {"verdict": "failed", "figures": {}}]).ok is False
    )
