"""``groundstation parts``: the whole system on one screen."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from groundstation.cli.parts import app
from groundstation.parts.table import installed_tables
from groundstation.rig.overview import HEADINGS, OF_RUNNERS, as_markdown, overview
from groundstation.rig.plan import nodes_of, processes_of
from groundstation.rig.read import load_rig

RIGS = sorted((Path(__file__).parents[4] / "examples" / "rigs").glob("*.toml"))
TABLES = installed_tables()


def printed(*arguments):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.output


def words(text):
    return set(re.findall(r"[\w*]+", text))


@pytest.mark.parametrize("options", [(), ("--markdown",)])
def test_the_command_shows_every_part_topic_and_node(options):
    text = printed(*options)
    shown = words(text)
    for name in (*TABLES.parts, *TABLES.payloads, *TABLES.nodes):
        assert name in shown, name
    for part in TABLES.parts.values():
        assert part.summary in text


@pytest.mark.parametrize("path", RIGS, ids=lambda path: path.stem)
def test_of_a_rig_it_shows_every_topic_node_and_process(path):
    rig = load_rig(path)
    shown = words(printed(path))
    for noun in TABLES.payloads:
        assert noun in shown
    for placed in nodes_of(rig):
        assert placed.row.name in shown
    for process in processes_of(rig):
        names = {process.replace(vehicle, "*", 1) for vehicle in rig.vehicles} | {process}
        assert names & shown, process


def row_of(rig, noun):
    return next(row for row in overview(rig).rows if row.noun == noun)


def test_a_row_says_who_publishes_where_and_who_receives():
    state = row_of(load_rig(next(path for path in RIGS if path.stem == "two_mock_ups")), "state")
    assert (state.part, state.publishers, state.processes) == ("fusion", ("fusion",), ("*_flight",))
    assert "controller" in state.receivers  # of the same process
    assert "command_mux (commands)" in state.receivers
    assert state.cells()[2] == f"{state.rate_hz:g}/s"


def test_a_topic_of_the_runners_is_theirs():
    for noun in OF_RUNNERS:
        assert row_of(None, noun).publishers == ("the runner",)


def test_what_arrives_from_outside_names_its_port():
    rig = load_rig(next(path for path in RIGS if path.stem == "two_mock_ups"))
    assert row_of(rig, "imu_bytes").publishers == ("port */imu",)
    assert row_of(rig, "imu_bytes").receivers == ("imu_reader",)
    assert row_of(rig, "can_in").publishers == ("port valve_bus",)


def test_latched_topics_and_those_that_come_by_event_say_so():
    assert row_of(None, "faults").cells()[2] == "latched"
    assert row_of(None, "can_in").cells()[2] in {"by event", f"{row_of(None, 'can_in').rate_hz:g}/s"}
    assert row_of(None, "request").cells()[2] == "by event"


def test_names_of_vehicles_are_left_out_since_all_are_alike():
    rig = load_rig(next(path for path in RIGS if path.stem == "two_mock_ups"))
    shown = {process for row in overview(rig).rows for process in row.processes}
    assert {"*_flight", "*_sky", "commands", "station"} <= shown
    assert not any(vehicle in process for process in shown for vehicle in rig.vehicles)


def test_the_page_of_the_documentation_is_a_table_with_a_row_per_topic():
    lines = as_markdown(overview(None)).splitlines()
    head = lines.index(f"| {' | '.join(HEADINGS)} |")
    rows = lines[head + 2 :]
    assert len(rows) == len(TABLES.payloads)
    assert all(line.count("|") == len(HEADINGS) + 1 for line in rows)
