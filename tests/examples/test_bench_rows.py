"""The parts of ``make bench`` that can be wrong without anybody seeing it in the table."""

import importlib
from pathlib import Path

import pytest

from drivers.laboratory import load_laboratory
from groundstation.bus.journal import JournalWriter
from groundstation.messages.definitions import Imu, ImuBytes, VehicleState
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder
from groundstation.runtime.lockstep import LockstepRunner
from groundstation.runtime.node_table import build_slots
from groundstation.runtime.ports import ports_of
from groundstation.runtime.rig import load_rig
from groundstation.runtime.slot import Sequences

ROOT = Path(__file__).parents[2]


@pytest.fixture
def bench(monkeypatch):
    """Imports a module of tools/bench as tools/bench.py does."""
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    return lambda name: importlib.import_module(f"bench.{name}")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("bench") / "run.mcap"
    rig = load_rig(ROOT / "examples" / "rigs" / "drawn_fixes.toml")
    journal, sequences = JournalWriter(), Sequences()
    slots = build_slots(rig, None, journal, sequences, measure=False)
    laboratory = load_laboratory("emulator", rig.laboratory.table, 1)
    with Recorder(path, RecordingInfo()) as recorder:
        runner = LockstepRunner(slots, laboratory, ports_of(rig), [recorder.record], journal, sequences)
        runner.run(4_000_000_000)
        runner.close()
    return path


def test_a_line_of_another_bench_is_a_row_only_with_four_cells_and_a_verdict(bench):
    parse = bench("other_benches").parse_row
    assert parse("fix | 30 ms | 12 ms | yes").ok is True
    assert parse("| fix | 30 ms | 12 ms | NO |").ok is False
    assert parse("fix |  | 12 ms | ").ok is None
    assert parse("what | limit | measured | ok") is None
    assert parse("solving frame 12 of 300") is None


def test_the_page_keeps_everything_outside_its_marks(bench, tmp_path):
    rows, table = bench("rows"), bench("table")
    page = tmp_path / "page.md"
    page.write_text(f"before\n{table.BEGIN}\nold\n{table.END}\nafter\n")
    table.write(page, [rows.Row("speed", "5x", "9x", ok=True)], "Today.")
    said = page.read_text()
    assert said.startswith("before\n")
    assert said.endswith("\nafter\n")
    assert "| speed | 5x | 9x | yes |" in said
    assert "old" not in said
    assert list(tmp_path.iterdir()) == [page]


def test_a_page_without_marks_is_refused_and_left_alone(bench, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("nothing here")
    with pytest.raises(ValueError, match="needs the marks"):
        bench("table").write(page, [], "Today.")
    assert page.read_text() == "nothing here"


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
