"""A recording whose file is moved, deleted or covered in the making: it is followed, or missed at once."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.parts.operation.messages import Latency
from groundstation.recording import disk_file
from groundstation.recording.disk_file import free_bytes
from groundstation.recording.errors import DeletedFileError, NoRoomError, RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder
from tests.unit.groundstation.launch.test_recorder_reporter import INFO, record

ROOT = Path(__file__).parents[4]


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "run"
    path.mkdir()
    return path


@pytest.fixture
def recorder(folder):
    made = Recorder(folder / "x.mcap", INFO, spare_bytes=1)
    record(made, 1, 2, 3)
    assert not made.check_place()
    yield made
    made.discard()


def sequences(path):
    with Recording(path) as recording:
        return [row.envelope.sequence for row in recording.delivered([Latency], ["alpha"])]


def test_a_folder_that_is_renamed_is_followed_and_nothing_is_lost(recorder, folder, tmp_path):
    folder.rename(tmp_path / "elsewhere")
    record(recorder, 4, 5)
    assert recorder.free_bytes > 0
    assert recorder.check_place()
    assert not recorder.check_place()
    assert recorder.part_path == tmp_path / "elsewhere" / "x.mcap.part"
    (tmp_path / "elsewhere").rename(tmp_path / "at the end")
    assert recorder.finish() == tmp_path / "at the end" / "x.mcap"
    assert sequences(recorder.path) == [1, 2, 3, 4, 5]
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["at the end", "x.mcap"]


def test_a_file_that_people_gave_a_name_of_its_own_keeps_it(recorder, folder, tmp_path):
    recorder.part_path.rename(tmp_path / "kept.mcap")
    record(recorder, 4)
    assert recorder.finish() == tmp_path / "kept.mcap"
    assert sequences(tmp_path / "kept.mcap") == [1, 2, 3, 4]
    assert not list(folder.iterdir())


def test_a_link_to_the_folder_may_lead_elsewhere_meanwhile(folder, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(folder)
    with Recorder(link / "x.mcap", INFO) as recorder:
        record(recorder, 1)
        link.unlink()
        link.symlink_to(tmp_path)
        assert recorder.check_place()
    assert sequences(folder / "x.mcap") == [1]


@pytest.mark.parametrize("what", ["the file", "the folder", "another in its place"])
def test_a_file_that_was_deleted_is_missed_and_never_called_finished(recorder, folder, what):
    if what == "the folder":
        shutil.rmtree(folder)
    else:
        recorder.part_path.unlink()
    if what == "another in its place":
        recorder.part_path.write_bytes(b"somebody else's")
    with pytest.raises(DeletedFileError, match=r"x\.mcap\.part was deleted"):
        recorder.check_place()
    for _ in range(2):
        with pytest.raises(DeletedFileError):
            recorder.finish()
    recorder.discard()
    if what == "another in its place":
        assert (folder / "x.mcap.part").read_bytes() == b"somebody else's"


def test_what_cannot_get_its_name_is_not_called_finished_and_may_be_tried_again(
    recorder, folder, monkeypatch
):
    def refuse(path, target):
        raise PermissionError(13, "Permission denied", str(path), None, str(target))

    with monkeypatch.context() as patched:
        patched.setattr(Path, "rename", refuse)
        for _ in range(2):
            with pytest.raises(RecordingError, match="Permission denied"):
                recorder.finish()
    assert sequences(folder / "x.mcap.part") == [1, 2, 3], "it has its index, and that once"
    assert recorder.finish() == folder / "x.mcap"
    assert sequences(folder / "x.mcap") == [1, 2, 3]


def test_a_file_that_came_meanwhile_is_not_written_over(recorder, folder):
    (folder / "x.mcap").write_bytes(b"somebody else's")
    assert recorder.finish() == folder / "x_1.mcap"
    assert (folder / "x.mcap").read_bytes() == b"somebody else's"
    assert sequences(folder / "x_1.mcap") == [1, 2, 3]


def test_the_room_for_another_file_is_asked_of_the_disk_where_its_folder_would_be_made(tmp_path):
    assert free_bytes(tmp_path / "not" / "there" / "x.mcap") == pytest.approx(
        free_bytes(tmp_path / "x"), rel=0.1
    )


def test_only_a_full_disk_is_called_full(tmp_path):
    with pytest.raises(NoRoomError), disk_file.on_disk(tmp_path):
        raise OSError(28, os.strerror(28))
    with pytest.raises(RecordingError) as caught, disk_file.on_disk(tmp_path):
        raise OSError(5, os.strerror(5))
    assert not isinstance(caught.value, NoRoomError)


UNMOUNTED = """
import subprocess, sys
from pathlib import Path
from groundstation.launch.recorder_pause import Pause
from groundstation.recording.errors import UnreachableFileError
from groundstation.recording.writer import Recorder
from tests.unit.groundstation.launch.test_recorder_reporter import INFO, record
from tests.unit.groundstation.recording.test_moved_file import sequences

first = Path(sys.argv[1])
subprocess.run(["mount", "-t", "tmpfs", "none", first.parent], check=True)
lost = Recorder(first, INFO)
record(lost, 1, 2)
subprocess.run(["umount", "-l", first.parent], check=True)
record(lost, 3)
try:
    lost.check_place()
except UnreachableFileError as error:
    print(error)
pause = Pause(lost, first, lambda path: Recorder(path, INFO), is_full=False)
print(pause.words())
following = pause.try_to_go_on()
record(following, 4)
print(sequences(following.finish()))
"""


def test_a_disk_that_is_unmounted_is_missed_and_recording_goes_on_where_its_folder_was(folder):
    can_mount = subprocess.run(["unshare", "-rm", "true"], capture_output=True, check=False).returncode == 0
    if not can_mount:
        pytest.skip("nobody may mount a disk here")
    done = subprocess.run(
        ["unshare", "-rm", sys.executable, "-c", UNMOUNTED, str(folder / "x.mcap")],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert done.stdout.splitlines() == [
        f"no path leads to {folder / 'x.mcap.part'} any more: "
        "its disk was unmounted, or another lies over it",
        "Where that disk is mounted again, x.mcap.part is complete on it.",
        "[4]",
    ], done.stderr
    assert sequences(folder / "x_1.mcap") == [4]
