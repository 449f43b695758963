"""A recording that people move or delete in flight: it is followed, or named as lost and begun anew."""

import pytest

from groundstation.parts.fusion.messages import VehicleState
from groundstation.recording.reader import Recording

pytestmark = pytest.mark.slow


def flying(launch, rig, *words):
    run = launch(rig, *words)
    run.wait_until_flying()
    run.forget()
    return run


def check_without_a_gap(path):
    with Recording(path) as recording:
        numbers = [row.envelope.sequence for row in recording.delivered([VehicleState], ["alpha"])]
    assert len(numbers) > 50
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def test_a_recording_whose_folder_is_renamed_is_whole_in_the_renamed_folder(launch, two_drawn, tmp_path):
    asked, moved = tmp_path / "asked", tmp_path / "moved"
    run = flying(launch, two_drawn, "--record", str(asked / "run.mcap"))
    asked.rename(moved)
    assert str(moved) in run.wait_for("recorder: the recording was moved: it goes on in")
    run.wait_for("alpha flying")
    run.end_in_order()
    assert f"recording: {moved / 'run.mcap'}" in run.lines
    assert any(line.endswith(f"{moved / 'run.mcap'} is complete") for line in run.lines)
    check_without_a_gap(moved / "run.mcap")
    assert not asked.exists()


@pytest.mark.provokes("recording_lost")
def test_a_recording_that_is_deleted_is_a_fault_and_goes_on_in_another_file(launch, two_drawn):
    run = flying(launch, two_drawn)
    run.recording.with_name("run.mcap.part").unlink()
    assert "What it held is lost." in run.wait_for("recorder: ", "was deleted")
    run.wait_for("recording goes on in", "run_1.mcap")
    run.rewind()
    assert "was deleted" in run.wait_for("alpha: FAULT recording_lost")
    run.wait_for("alpha: fault recording_lost is gone")
    code, _ = run.end()
    text = "\n".join(run.lines)
    assert code == 1, text
    assert "is complete" not in text
    assert "groundstation: " in run.lines[-1]
    assert "run.mcap.part was deleted" in run.lines[-1]
    check_without_a_gap(run.recording.with_stem("run_1"))
