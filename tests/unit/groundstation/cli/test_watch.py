"""``groundstation watch`` on a real hub: every line, its end, and what it says of wrong names."""

import csv
import itertools
import os
import pty
import re
import signal
import threading

import pytest

from groundstation.cli.main import call
from groundstation.declarations.errors import UsageError
from groundstation.declarations.lease import Lease
from groundstation.launch.running import RunningRig
from groundstation.parts.fusion.messages import VehicleState


def state(number, vehicle="alpha"):
    return VehicleState(
        1_500_000_001 * number, vehicle, (0.1 * number, -0.2), 0.3, (0.0, 0.0), 0.0, (0.0,) * 3, "flying", 0
    )


@pytest.fixture
def published(fake_run):
    """Publishes numbered states until the test is over."""
    done = threading.Event()

    def publish():
        number = 0
        while not done.wait(0.01):
            number += 1
            fake_run.publish(state(number), state(number, "beta"))

    thread = threading.Thread(target=publish)
    thread.start()
    yield fake_run
    done.set()
    thread.join()


@pytest.mark.slow
def test_lines_are_csv_that_can_be_read_back_and_none_is_missing(published):
    process = published.command("watch", "alpha/state", "--count", "30")
    output, errors = process.communicate(timeout=90)
    assert (process.returncode, errors) == (0, "")
    rows = list(csv.DictReader(output.splitlines()))
    assert len(rows) == 30
    numbers = [round(float(row["position_table_m[0]"]) / 0.1) for row in rows]
    assert numbers == list(range(numbers[0], numbers[0] + 30))
    assert rows[0]["stamp_s"] == "{}.{:09d}".format(*divmod(1_500_000_001 * numbers[0], 10**9))
    assert rows[0]["status"] == "flying"


def test_one_field_and_one_element(published, groundstation):
    output = groundstation("watch", "alpha/state.position_table_m", "--count", "1").output.splitlines()
    assert output[0] == "stamp_s,position_table_m[0],position_table_m[1]"
    assert output[1].endswith(",-0.2")
    output = groundstation("watch", "alpha/state.position_table_m[1]", "--count", "2").output.splitlines()
    assert [line.partition(",")[2] for line in output] == ["position_table_m[1]", "-0.2", "-0.2"]


def test_every_so_often_the_newest_is_shown(published, groundstation):
    output = groundstation("watch", "alpha/state.heading_rad", "--every", "0.2", "--count", "3").output
    stamps = [float(line.partition(",")[0]) for line in output.splitlines()[1:]]
    assert len(stamps) == 3
    assert all(later > earlier + 1.5 for earlier, later in itertools.pairwise(stamps))


@pytest.mark.slow
def test_ctrl_c_ends_it_cleanly(published):
    process = published.command("watch", "alpha/state")
    assert process.stdout.readline().startswith("stamp_s,")
    assert "flying" in process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, "")


@pytest.mark.slow
def test_a_reader_that_goes_away_ends_it(published):
    process = published.command("watch", "alpha/state")
    process.stdout.readline()
    process.stdout.close()
    assert process.wait(timeout=60) == 1
    assert "Traceback" not in process.stderr.read()
    process.stderr.close()


@pytest.mark.slow
def test_the_end_of_the_rig_ends_it(published):
    process = published.command("watch", "alpha/state.status")
    assert process.stdout.readline() == "stamp_s,status\n"
    assert "flying" in process.stdout.readline()
    next((published.folder / "groundstation").glob("*.json")).unlink()
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, "a rig has ended\n")


@pytest.mark.slow
def test_what_is_not_published_is_said_and_what_comes_then_is_shown(fake_run):
    process = fake_run.command("watch", "lease.holder", "--count", "1")
    assert process.stderr.readline().startswith("nothing has been published there")
    fake_run.publish(Lease(0, "", "anna", 5, ""), owner="")
    output, _ = process.communicate(timeout=60)
    assert (process.returncode, output) == (0, "stamp_s,holder\n0.000000000,anna\n")


@pytest.mark.slow
def test_on_a_terminal_it_is_a_table_that_fits(published):
    ours, theirs = pty.openpty()
    process = published.command("watch", "alpha/state.position_table_m", "--count", "2", stdout=theirs)
    os.close(theirs)
    assert process.wait(timeout=90) == 0
    text = os.read(ours, 65536).decode()
    os.close(ours)
    process.stderr.close()
    lines = text.replace("\r", "").splitlines()
    assert lines[0].split() == ["stamp_s", "position_table_m[0]", "position_table_m[1]"]
    assert re.fullmatch(r" +\d+\.\d{3} +[\d.]+ +-0\.2", lines[1])


@pytest.mark.parametrize(
    ("topic", "words"),
    [
        ("alpha/stat", "near it are alpha/state"),
        ("gamma/state", "near it are alpha/state, beta/state"),
        ("alpha/state.headnig_rad", "near it are heading_rad"),
    ],
)
def test_a_wrong_name_is_one_sentence_that_names_near_ones(fake_run, groundstation, topic, words):
    with pytest.raises(UsageError) as refusal:
        groundstation("watch", topic)
    assert words in str(refusal.value)


def test_a_rig_that_is_not_reached_leaves_no_output(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    RunningRig(os.getpid(), "gone", "tcp/127.0.0.1:9", ("alpha",)).announce()
    assert call(["watch", "alpha/state"]) == 1
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "the hub at tcp/127.0.0.1:9 cannot be reached" in shown.err


def test_where_no_rig_runs_it_says_so(tmp_path, monkeypatch, groundstation):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with pytest.raises(UsageError, match="no rig is running"):
        groundstation("watch", "alpha/state")
