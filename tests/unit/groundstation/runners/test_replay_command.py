"""A flight in virtual time, recorded and replayed by the commands that people type."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from groundstation.cli.replay import app as replay_app
from groundstation.core.library import default_core
from groundstation.declarations.errors import UsageError
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.fusion.messages import VehicleState
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover
from groundstation.rig.read import load_rig, read_text

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"


def fly(recording, duration_s):
    run_lockstep(load_rig(RIG), read_text(RIG), RIG, recording, duration_s, 3, lambda *_: None)
    return recording


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    return fly(tmp_path_factory.mktemp("flight") / "flight.mcap", 2.0)


def call(*arguments):
    result = CliRunner().invoke(replay_app, [str(a) for a in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.output


def test_every_node_of_the_flight_replays_bit_for_bit(flight):
    code, reported = call(flight)
    assert code == 0, reported
    assert "all agrees" in reported
    assert "state " in reported


def test_replay_tells_when_other_code_recorded(flight, monkeypatch):
    with Recording(flight) as found:
        assert default_core().name in found.info.software
    monkeypatch.setattr("groundstation.cli.replay.software", lambda: "another ground station")
    code, reported = call(flight)
    assert code == 0
    assert default_core().name in " ".join(reported.split())
    assert "replayed with another ground station" in " ".join(reported.split())


def test_equal_seeds_give_equal_files(tmp_path, flight):
    assert fly(tmp_path / "again.mcap", 2.0).read_bytes() == flight.read_bytes()


def test_one_node_with_another_rig_is_compared_and_written(tmp_path, flight):
    changed, count = re.subn(r"(gyro_density\w+) = \S+", r"\1 = 1e-3", RIG.read_text(), count=1)
    assert count == 1
    rig, out = tmp_path / "changed.toml", tmp_path / "fusion.mcap"
    rig.write_text(changed)
    code, reported = call(flight, "--node", "alpha/fusion", "--rig", rig, "--out", out)
    assert code == 1
    assert "first difference in" in reported
    with Recording(out) as now, Recording(flight) as then:
        assert now.info.rig_toml == changed
        assert [r.log_ns for r in now.messages([VehicleState])] == [
            r.log_ns for r in then.messages([VehicleState])
        ]


def test_a_recovered_flight_replays(tmp_path, flight):
    torn = tmp_path / "torn.mcap.part"
    torn.write_bytes(flight.read_bytes()[: flight.stat().st_size // 2])
    assert recover(torn, tmp_path / "torn.mcap").messages > 100
    assert call(tmp_path / "torn.mcap")[0] == 0


def test_a_rig_without_the_node_is_refused(tmp_path, flight):
    rig = tmp_path / "other.toml"
    rig.write_text(RIG.read_text().replace("alpha", "gamma"))
    with pytest.raises(UsageError, match="'alpha/fusion' is no node of the rig"):
        call(flight, "--node", "alpha/fusion", "--rig", rig)


def test_a_refused_replay_leaves_no_file(tmp_path, flight):
    with pytest.raises(UsageError, match="'alpha/fuson'"):
        call(flight, "--node", "alpha/fuson", "--out", tmp_path / "out.mcap")
    with pytest.raises(UsageError, match="there is no such rig file"):
        call(flight, "--rig", tmp_path / "nothing.toml", "--out", tmp_path / "out.mcap")
    with pytest.raises(UsageError, match="No such file"):
        call(tmp_path / "nothing.mcap")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_flight_to_its_station_replays_bit_for_bit(tmp_path):
    code, reported = call(fly(tmp_path / "long.mcap", 40.0))
    assert code == 0, reported
