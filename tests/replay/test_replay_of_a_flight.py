"""Two lockstep runs with one seed are equal byte for byte, and a replay says what was said, bit for bit."""

from pathlib import Path

import pytest

from groundstation.launch.lockstep_run import run_lockstep
from groundstation.recording.reader import Recording
from groundstation.rig.plan import make_node, nodes_of
from groundstation.rig.read import load_rig, parse_rig, read_text
from groundstation.runners.replay import ReplayRunner, recorded_nodes

RIGS = Path(__file__).parents[2] / "examples" / "rigs"


def record(folder, rig_name, seconds, seed, name="run"):
    """A recording of a lockstep run."""
    path = folder / f"{name}.mcap"
    rig_path = RIGS / f"{rig_name}.toml"
    run_lockstep(load_rig(rig_path), read_text(rig_path), rig_path, path, seconds, seed, lambda *_: None)
    return path


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    return record(tmp_path_factory.mktemp("flown"), "drawn_fixes", 12.0, 5)


def replayed(path):
    with Recording(path) as recording:
        rig = parse_rig(recording.info.rig_toml, Path(recording.info.rig_path))
        runner = ReplayRunner(recording, lambda key: make_node(rig, key))
        return recorded_nodes(recording), rig, runner.run()


def test_the_same_seed_gives_the_same_bytes(flown, tmp_path):
    again = record(tmp_path, "drawn_fixes", 12.0, 5)
    assert again.read_bytes() == flown.read_bytes()


def test_another_seed_gives_another_flight(flown, tmp_path):
    other = record(tmp_path, "drawn_fixes", 12.0, 6)
    assert other.read_bytes() != flown.read_bytes()


def test_every_node_of_a_flight_is_replayed_bit_for_bit(flown):
    keys, rig, report = replayed(flown)
    assert keys == tuple(sorted(placed.key for placed in nodes_of(rig)))
    assert set(report.nodes) == set(keys)
    assert not report.missing_inputs
    assert report.agrees
    assert not any(row.close or row.unrecorded for row in report.results)
    assert sum(row.equal for row in report.results) > 5000


@pytest.mark.slow
@pytest.mark.parametrize("rig_name", ["published", "published_condition", "late_pipeline"])
def test_a_flight_by_rendered_stars_is_equal_twice_and_replayed_bit_for_bit(rig_name, tmp_path):
    first = record(tmp_path, rig_name, 14.0, 3, "first")
    second = record(tmp_path, rig_name, 14.0, 3, "second")
    assert first.read_bytes() == second.read_bytes()
    _, _, report = replayed(first)
    assert report.agrees
    assert not report.missing_inputs
    assert {key.rpartition("/")[2] for key in report.refused} == {
        "picture_check",
        "picture_keeper",
        "spot_finder",
    }
