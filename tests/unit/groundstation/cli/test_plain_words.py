"""Words on terminals that know ASCII only, and numbers that are none."""

import ast
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.cli.main import COMMANDS, call
from groundstation.cli.plain_words import SPELLED, speak_any_locale

ROOT = Path(__file__).parents[4]
RIG = ROOT / "examples" / "rigs" / "drawn_fixes.toml"
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}


def signs():
    """Every character beyond ASCII of every text in our commands and what they print."""
    found = set()
    for room in ("groundstation", "calibration", "drivers"):
        for path in (ROOT / room).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Constant) and isinstance(node.value, str):
                    found |= {sign for sign in node.value if ord(sign) > 127}
    return found


def test_every_sign_that_our_words_use_can_be_spelled_out():
    missing = signs() - set(SPELLED)
    assert not {sign for sign in missing if not sign.isalpha()}, missing


@pytest.mark.parametrize("name", ["ascii", "latin-1", "cp1252", "utf-8"])
def test_what_an_encoding_lacks_is_spelled_out_and_a_file_name_goes_out_as_it_is(name, monkeypatch):
    data = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(data, encoding=name))
    speak_any_locale()
    print("1.5 ± 0.1 → done:", b"S\xc3\xbcd.csv".decode("ascii", "surrogateescape"))
    sys.stdout.flush()
    want = "1.5 ± 0.1 → done: "
    spelled = "".join(SPELLED[sign] if not can(sign, name) else sign for sign in want)
    assert data.getvalue() == spelled.encode(name) + b"S\xc3\xbcd.csv" + os.linesep.encode()


def can(sign, name):
    if ord(sign) < 128:
        return True
    try:
        sign.encode(name)
    except UnicodeEncodeError:
        return False
    return True


@pytest.mark.parametrize("words", [["--help"], *([name, "--help"] for name in COMMANDS)], ids=" ".join)
def test_help_is_readable_and_shows_no_marks_of_its_making(words, capsys):
    assert call(words) == 0
    shown = capsys.readouterr().out
    assert "\\b" not in shown
    assert "\b" not in shown
    examples = [line for line in shown.splitlines() if line.lstrip().startswith("Example:")]
    assert all(line.count("groundstation ") == 1 for line in examples), examples


def test_a_rig_and_files_beyond_ascii_fly_under_an_ascii_locale(tmp_path):
    folder = tmp_path / "Prüfstand"
    folder.mkdir()
    rig = folder / "Süd.toml"
    rig.write_text(RIG.read_text().replace('name = "', 'name = "Lübeck ± ', 1), encoding="utf-8")
    out = folder / "Flug.mcap"
    words = ["run", rig, "--lockstep", "--duration", "1", "--record", out]
    environment = os.environ | ASCII | {"PYTHONPATH": str(ROOT)}

    def run(*words):
        return subprocess.run(
            [sys.executable, "-m", "groundstation", *map(str, words)],
            capture_output=True, check=False, cwd=tmp_path, env=environment,
        )  # fmt: skip

    done = run(*words)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(b"recording: " + str(out).encode())
    done = run("recording", "info", out)
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr
    done = run("replay", out)
    assert done.returncode == 0, done.stderr + done.stdout
    done = run("replay", out, "--rig", rig)
    assert done.returncode == 0, done.stderr + done.stdout
    done = run("run", folder / "Nord.toml", "--lockstep", "--duration", "1")
    assert done.returncode == 2
    assert (
        done.stderr.decode()
        == f"groundstation: {folder / 'Nord.toml'}: there is no such scenario or rig file\n"
    )


@pytest.mark.parametrize("value", ["inf", "-inf", "nan", "1e400"])
@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["run", RIG, "--lockstep"], "--duration"),
        (["request", "alpha", "stop"], "--timeout"),
        (["inject", "alpha", "stuck_open_valve"], "--for"),
        (["calibrate", "delay", "x", "--out", "y"], "--guess-s"),
        (["calibrate", "mount", "x", "--out", "y"], "--first-heading-deg"),
        (["calibrate", "survey", "x", "--out", "y"], "--tape-std-mm"),
        (["calibrate", "tilt", "x", "--out", "y"], "--tilt-sigma-deg"),
        (["calibrate", "zero-offset-fit", "x", "--end-s", "3", "--out", "y"], "--start-s"),
        (["calibrate", "overhead", "x", "--out", "y"], "--square-mm"),
    ],
    ids=lambda given: " ".join(map(str, given[:2])) if isinstance(given, list) else given,
)
def test_infinity_and_nan_are_no_numbers_of_a_command(words, option, value, capsys):
    assert call([*map(str, words), f"{option}={value}"]) == 2
    reported = capsys.readouterr()
    assert option in reported.err
    assert "Traceback" not in reported.err
