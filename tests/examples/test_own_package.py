"""A package adds a sensor, its twin, a controller and a command; nothing else in the tree changes for it."""

import importlib
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.parts.control.messages import ControlStatus
from groundstation.recording.reader import Recording

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "examples" / "own_package"
RIG = PACKAGE / "rig.toml"
PAGES = [
    ROOT / "docs" / "how_to" / f"{name}.md" for name in ("add_a_sensor", "add_a_controller", "own_package")
]
HOLD_X_M = 0.2


def call(*words, packages, module="groundstation"):
    """A module, usually ``groundstation``, with packages installed; the finished process."""
    path = os.pathsep.join([*map(str, packages), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    return subprocess.run(
        [sys.executable, "-m", module, *map(str, words)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def flown(own_package, tmp_path_factory):
    """A recording of 20 s of the package's rig in virtual time."""
    folder = tmp_path_factory.mktemp("flown")
    rig, recording = folder / "rig.toml", folder / "run.mcap"
    short_rest = "[mock_ups.standard.fusion]\nrest_s = 1.5\n\n[vehicles.alpha]"
    rig.write_text(RIG.read_text().replace("[vehicles.alpha]", short_rest))
    done = call("run", rig, "--lockstep", "--duration", "20", "--record", recording, packages=[own_package])
    assert done.returncode == 0, done.stderr
    return recording


@pytest.fixture
def protocol(monkeypatch):
    """The wire format of the package."""
    monkeypatch.syspath_prepend(str(PACKAGE))
    return importlib.import_module("range_finder.protocol")


@pytest.fixture
def gremlin(tmp_path):
    """Makes an installed package whose module raises when it is imported, named by one entry point."""

    def make(group):
        package, about = tmp_path / "gremlin", tmp_path / "gremlin_sensor-1.0.dist-info"
        package.mkdir()
        about.mkdir()
        (package / "__init__.py").write_text('raise RuntimeError("the gremlin woke up")\n')
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: gremlin-sensor\nVersion: 1.0\n")
        (about / "entry_points.txt").write_text(f"[{group}]\ngremlin = gremlin:ROW\n")
        return tmp_path

    return make


def rows_of(text, noun):
    """Rows of a topic in what `groundstation parts --markdown` prints, as cells."""
    lines = text.replace("\\*", "*").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [row for row in cells if len(row) == 6 and row[1] == noun]


def test_parts_shows_the_topics_the_node_and_its_process(own_package):
    done = call("parts", RIG, "--markdown", packages=[own_package])
    assert done.returncode == 0, done.stderr
    assert rows_of(done.stdout, "range_bytes") == [
        ["range_finder", "range_bytes", "10/s", "port */range_finder", "*_range_finder", "range_reader"]
    ]
    assert rows_of(done.stdout, "range") == [
        ["range_finder", "range", "10/s", "range_reader", "*_range_finder", ""]
    ]
    (wrench,) = rows_of(done.stdout, "wrench")
    assert wrench[3:] == ["controller", "*_controller", "supervisor (commands), command_mux (commands)"]


def test_the_flight_is_flown_by_the_controller_of_the_package(flown):
    with Recording(flown) as recording:
        statuses = [row.payload for row in recording.messages((ControlStatus,))]
    assert {status.controller for status in statuses} == {"spring"}
    assert statuses[0].error_position_m > 0.2
    # a table 3.1 mm/s² off level moves a spring of 0.8 rad/s, which learns nothing, by 4.8 mm
    assert 0.002 < statuses[-1].error_position_m < 0.015


def test_what_was_recorded_is_the_distance_to_the_wall(flown, own_package):
    done = call("ranges", flown, packages=[own_package])
    assert done.returncode == 0, done.stderr
    line = re.fullmatch(r"alpha: (\d+) measurements, ([\d.]+) to ([\d.]+) m\n", done.stdout)
    assert int(line[1]) == pytest.approx(200, abs=2)
    # the wall is at x = 3 m, the device 0.15 m ahead of the body's origin, noise 3 mm
    assert float(line[2]) == pytest.approx(3.0 - 0.15 - HOLD_X_M, abs=0.03)
    assert float(line[3]) == pytest.approx((3.0 - 0.15) / math.cos(math.radians(5.0)), abs=0.03)


def test_a_replay_agrees_bit_for_bit(flown, own_package):
    done = call("replay", flown, packages=[own_package])
    assert done.returncode == 0, done.stdout
    assert re.search(r"^range +alpha +(19\d|200) *$", done.stdout, flags=re.MULTILINE)
    assert re.search(r"^wrench +alpha +\d+ *$", done.stdout, flags=re.MULTILINE)
    assert "all agrees" in done.stdout


def test_the_recording_reads_without_the_package(flown):
    done = call("recording", "info", flown, packages=[])
    assert done.returncode == 0, done.stderr
    assert re.search(r"\brange\b", done.stdout)


def test_the_command_explains_itself_and_stands_in_the_overview(own_package):
    done = call("ranges", "--help", packages=[own_package])
    assert done.returncode == 0
    assert "Example: groundstation ranges run.mcap" in done.stdout
    assert (
        "Print what range finders measured in a recording." in call("--help", packages=[own_package]).stdout
    )


def test_without_the_package_its_keys_are_unknown():
    done = call("parts", RIG, packages=[])
    assert done.returncode == 2
    assert "no known key" in done.stderr


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        (
            "frequency_rad_s = 0.8",
            "freqency_rad_s = 0.8",
            "vehicles.alpha.control.parameters.freqency_rad_s: is no parameter of this controller (a typo?)",
        ),
        (
            "frequency_rad_s = 0.8",
            "frequency_rad_s = 80",
            "vehicles.alpha.control.parameters.frequency_rad_s: Input should be less than or equal to 3",
        ),
        (
            "sigma_m = 0.003",
            "sigma = 0.003",
            "'mock_ups.standard.range_finder.sigma' is no known key (a typo?)",
        ),
        (
            'range_finder = "laboratory:alpha/range_finder"',
            'range_finder = "laboratory:alpha/rangefinder"',
            "the laboratory has no channel 'alpha/rangefinder'",
        ),
        ("rate_hz = 10.0", "rate_hz = -10.0", "range_finder.rate_hz"),
    ],
    ids=["misspelt parameter", "wild parameter", "misspelt key", "misspelt channel", "wrong twin"],
)
def test_a_mistake_in_the_rig_is_one_sentence(own_package, tmp_path, old, new, complaint):
    text = RIG.read_text()
    assert text.count(old) == 1
    rig = tmp_path / "rig.toml"
    rig.write_text(text.replace(old, new))
    done = call(
        *("run", rig, "--lockstep", "--duration", "1", "--record", tmp_path / "run.mcap"),
        packages=[own_package],
    )
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert complaint in done.stderr
    assert done.stderr.startswith(f"groundstation: {rig}: ")


@pytest.mark.parametrize(
    ("group", "words"),
    [
        ("groundstation.parts", ["parts"]),
        ("groundstation.controllers", ["parts", "examples/rigs/drawn_fixes.toml"]),
        ("groundstation.commands", ["gremlin"]),
        (
            "firmware_emulator.devices",
            ["run", "examples/rigs/drawn_fixes.toml", "--lockstep", "--duration", "1"],
        ),
    ],
)
def test_a_package_that_cannot_be_imported_is_named_in_one_sentence(gremlin, tmp_path, group, words):
    record = ["--record", tmp_path / "run.mcap"] if "run" in words else []
    done = call(*words, *record, packages=[gremlin(group)])
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "gremlin-sensor" in done.stderr
    assert "RuntimeError: the gremlin woke up" in done.stderr


@pytest.mark.slow
def test_the_contract_tests_find_the_rows_of_the_package(own_package):
    done = call(
        *("-q", "-n", "0", "tests/contract/test_topics.py"),
        *("tests/unit/groundstation/control/test_control_contract.py", "-k", "range or spring"),
        packages=[own_package],
        module="pytest",
    )
    assert done.returncode == 0, done.stdout
    assert int(re.search(r"(\d+) passed", done.stdout)[1]) >= 15


def lines_of(protocol):
    return [
        protocol.Reading(17, 1.6552),
        protocol.Reading(18, None),
        protocol.Reading(65535, 0.0),
        protocol.Reading(0, 123.4567),
    ]


def test_the_lines_of_the_documents_are_those_of_the_protocol(protocol):
    examples = [protocol.encode(reading).decode().rstrip() for reading in lines_of(protocol)[:2]]
    assert examples == ["$LRF,17,1655.2*45", "$LRF,18,*51"]
    for text in (protocol.__doc__, (PACKAGE / "README.md").read_text()):
        assert all(example in text for example in examples)


def test_readings_survive_their_lines_cut_anywhere(protocol):
    readings = lines_of(protocol)
    begun_before = b"5.2*31\r\n"  # we did not listen yet
    stream = begun_before + b"".join(map(protocol.encode, readings))
    for size in range(1, len(stream) + 1):
        parser = protocol.LineParser()
        found = [
            reading for i in range(0, len(stream), size) for reading in parser.feed(stream[i : i + size])
        ]
        assert [reading.number for reading in found] == [17, 18, 65535, 0]
        assert [reading.distance_m for reading in found] == pytest.approx(
            [1.6552, None, 0.0, 123.4567], abs=5e-5
        )
        assert (parser.lines_refused, parser.lines_lost) == (0, 65535 - 18 - 1)


def test_a_flipped_bit_is_noticed_and_the_next_line_is_read(protocol):
    first, second, third = (protocol.encode(protocol.Reading(number, 1.0 + number)) for number in (1, 2, 3))
    for bit in range(8 * len(second)):
        damaged = bytearray(second)
        damaged[bit // 8] ^= 1 << bit % 8
        parser = protocol.LineParser()
        numbers = [reading.number for reading in parser.feed(first + bytes(damaged) + third)]
        assert numbers == [1, 3]
        assert parser.lines_lost == 1


def test_noise_without_end_is_counted_and_not_kept(protocol):
    parser = protocol.LineParser()
    noise = bytes(range(256)) * 40
    assert not list(parser.feed(noise))
    assert parser.lines_refused == 39
    assert [
        reading.number for reading in parser.feed(b"\r\n" + protocol.encode(protocol.Reading(5, 1.0)))
    ] == [5]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_of_a_page_is_that_of_the_package(page):
    blocks = re.findall(r"```(?:python|toml)\n# (\S+)\n(.*?)```", page.read_text(), flags=re.DOTALL)
    assert blocks
    for name, code in blocks:
        assert code in (PACKAGE / name).read_text(), code
