"""A rig that cannot be flown: one sentence with file and key, exit code 2, no traceback, no output."""

import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.cli.main import call

RIGS = Path(__file__).parents[4] / "examples" / "rigs"
RECORDED = Path(__file__).parents[3] / "replay" / "recordings" / "formation.mcap"
DRAWN = (RIGS / "drawn_fixes.toml").read_text()
RENDERED = (
    (RIGS / "two_mock_ups.toml")
    .read_text()
    .replace("../../calibration", str(RIGS.parents[1] / "calibration"))
)

WRONG = {
    "no TOML": (DRAWN + "\n[oops", "is not valid TOML"),
    "a typo in a key": (DRAWN.replace("bus_index", "bus_idx"), "vehicles.alpha.bus_i"),
    "a missing key": (DRAWN.replace('valve_bus = "laboratory:valve_bus"', ""), "'valve_bus' is missing"),
    "a text for a number": (
        DRAWN.replace("x_max_m = 2.0", 'x_max_m = "wide"'), "table.x_max_m: ", "found 'wide'",
    ),
    "a baud rate that no block has": (
        DRAWN.replace("baud = 250000", "baud = 9600"), "mock_ups.standard.imu.baud",
    ),
    "an unknown mock-up": (
        DRAWN.replace('mock_up = "standard"', 'mock_up = "big"'),
        "vehicles.alpha.mock_up: 'big' is not among",
    ),
    "an unknown controller": (
        DRAWN + '\n[mock_ups.standard.control]\ncontroller = "wishful"\n', "controller 'wishful' is none of",
    ),
    "an unknown estimator": (
        DRAWN + '\n[mock_ups.standard.fusion]\nmethod = "guess"\n', "method 'guess' is none of",
    ),
    "an unknown node": (DRAWN + "\n[nodes.star_tracer]\nbusy_s = 0.6\n", "nodes.star_tracer: no such node"),
    "a heavy node beside an urgent one": (
        RENDERED + '\n[nodes.star_tracker]\nprocess = "{vehicle}_flight"\n',
        "holds star_tracker, which is heavy, beside",
    ),
    "no laboratory for its addresses": (
        DRAWN[: DRAWN.index("[laboratory]")], "needs a [laboratory] section",
    ),
    "a laboratory that is not installed": (DRAWN.replace('name = "emulator"', 'name = "moon"'), "'moon'"),
    "a typo in the laboratory's table": (
        DRAWN.replace("tilt_rad", "tild_rad"), "laboratory.table.tild_rad",
    ),
    "a seed that is no number": (
        DRAWN.replace("seed = 1", 'seed = "one"'), "laboratory.seed: expected a whole number", "found 'one'",
    ),
    "a laboratory without the channel": (
        DRAWN.replace("laboratory:alpha/imu", "laboratory:gamma/imu"), "no channel 'gamma/imu'",
    ),
    "a vehicle called like the rig's own topics": (
        DRAWN.replace("alpha", "rig"), "'rig' has a meaning on the bus",
    ),
    "a vehicle called like the record stream": (
        DRAWN.replace("alpha", "record"), "'record' has a meaning on the bus",
    ),
    "a vehicle called like a process": (
        DRAWN.replace("alpha", "commands"), "names both a vehicle and a process",
    ),
    "a delay file that is not there": (
        RENDERED.replace("delay_s = 0.015\ndelay_sigma_s = 0.001", 'delay_file = "nowhere.toml"', 1),
        "nowhere.toml: cannot be read",
    ),
    "a delay twice": (
        RENDERED.replace("delay_s = 0.015\n", 'delay_s = 0.015\ndelay_file = "delay.toml"\n', 1),
        "give either 'delay_file' or 'delay_s'",
    ),
    "a calibration file that is not there": (
        RENDERED.replace("calibration/rigs/emulated/ceiling.csv\"\ndelay_s", "nowhere.csv\"\ndelay_s"),
        "nowhere.csv",
    ),
}  # fmt: skip


def refused(capsys, *words):
    """The one sentence that a refused call of the command leaves on stderr."""
    assert call([str(word) for word in words]) == 2
    reported = capsys.readouterr()
    assert reported.out == ""
    assert reported.err.startswith("groundstation: ")
    assert reported.err.count("\n") == 1, reported.err
    return reported.err


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_rig_is_refused_in_one_sentence(what, tmp_path, capsys):
    text, *expected = WRONG[what]
    rig = tmp_path / "rig.toml"
    rig.write_text(text)
    out = tmp_path / "run.mcap"
    words = ("run", rig, "--lockstep", "--duration", "1", "--record", out, "--report", tmp_path / "report")
    sentence = refused(capsys, *words)
    for part in expected:
        assert part in sentence
    assert list(tmp_path.iterdir()) == [rig]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["nowhere.toml"], "nowhere.toml: there is no such scenario or rig file"),
        ([RIGS / "drawn_fixes.toml", "--lockstep"], "--lockstep needs --duration"),
        ([RIGS / "drawn_fixes.toml", "--seed", "3"], "--seed goes with --lockstep"),
        ([RIGS / "drawn_fixes.toml", "--lockstep", "--hub-port", "7447"], "--hub-port goes with real time"),
        ([RIGS.parent / "scenarios" / "go_to.toml", "--hub-port", "7447"], "--hub-port goes with a rig"),
        ([RIGS / "drawn_fixes.toml", "--record", RECORDED], "never overwritten"),
        ([RIGS / "drawn_fixes.toml", "--record", "noend"], "noend must end in .mcap"),
        ([RIGS / "drawn_fixes.toml", "--record", "run.MCAP"], "run.MCAP must end in .mcap"),
        ([RIGS / "drawn_fixes.toml", "--record", RECORDED / "x.mcap"], "formation.mcap is no folder"),
        ([RIGS / "drawn_fixes.toml", "--record", f"{'x' * 250}.mcap"], "File name too long"),
        ([RIGS / "drawn_fixes.toml", "--report", RECORDED / "x"], "no such folder can be made"),
        ([RIGS / "drawn_fixes.toml", "--report", "x" * 300], "File name too long"),
        ([RIGS / "drawn_fixes.toml", "--compare", RECORDED], "--compare goes with --report"),
        ([RIGS / "drawn_fixes.toml", "--report", "r", "--compare", "no.mcap"], "no.mcap cannot be opened"),
        ([RIGS / "drawn_fixes.toml", "--report", "r", "--compare", RIGS / "overhead.toml"], "is no MCAP"),
        ([RIGS], "cannot be read as a scenario or rig file"),
    ],
)  # fmt: skip
def test_a_call_that_makes_no_sense_is_refused(words, expected, capsys):
    assert expected in refused(capsys, "run", *words)


@pytest.mark.parametrize("what", ["a typo in the laboratory's table", "a calibration file that is not there"])
def test_what_a_child_process_refuses_ends_a_live_run_with_its_sentence(what, tmp_path):
    text, expected = WRONG[what]
    rig = tmp_path / "rig.toml"
    rig.write_text(text.replace("../../calibration", str(RIGS.parents[1] / "calibration")))
    words = [sys.executable, "-m", "groundstation", "run", rig, "--headless", "--record", tmp_path / "a.mcap"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1, done.stderr
    assert expected in done.stderr
