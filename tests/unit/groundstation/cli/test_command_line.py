"""The overview, groups, aliases, and what an installed package can add."""

import subprocess
import sys

import pytest

from calibration.commands import CALIBRATE
from groundstation.cli.command import Command, Group
from groundstation.cli.extensions import extension
from groundstation.cli.main import ALIASES, COMMANDS, call

HEAVY = ("numpy", "cv2", "zenoh", "scipy", "matplotlib")


@pytest.mark.parametrize("name", CALIBRATE.members)
def test_every_calibration_is_listed_and_has_an_example(name, groundstation):
    overview = groundstation("calibrate", "--help").output
    assert f"  {name} " in overview
    assert CALIBRATE.members[name].summary in overview
    words = " ".join(groundstation("calibrate", name, "--help").output.split())
    assert f"Example: groundstation calibrate {name} " in words


def test_the_ground_station_reaches_calibration_by_its_entry_point(groundstation):
    assert "calibrate" not in COMMANDS
    assert extension("calibrate") is CALIBRATE
    assert f"calibrate     {CALIBRATE.summary}" in groundstation("--help").output


@pytest.mark.parametrize("alias", ALIASES)
def test_old_spellings_lead_to_a_calibration(alias, groundstation):
    group, member = ALIASES[alias]
    assert group == "calibrate"
    assert groundstation(*alias, "--help").output == groundstation(group, member, "--help").output


@pytest.mark.parametrize("words", [["--help"], ["calibrate", "--help"]])
def test_an_overview_loads_nothing_heavy(words):
    code = (
        "import sys; from groundstation.cli.main import build\n"
        f"try: build({words})({words})\n"
        "except SystemExit: pass\n"
        f"sys.exit(' '.join(name for name in {HEAVY} if name in sys.modules) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_what_no_command_is_called_is_refused(capsys):
    assert call(["calibrat"]) == 2
    assert call(["calibrate", "lenses"]) == 2
    assert "No such command 'lenses'" in capsys.readouterr().err


@pytest.fixture
def install(tmp_path, monkeypatch):
    """A package with one module and one command, as pip leaves it."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def make(name, source, value):
        (tmp_path / f"{name}.py").write_text(source)
        info = tmp_path / f"{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[groundstation.commands]\n{value}\n")
        monkeypatch.delitem(sys.modules, name, raising=False)

    return make


COMMAND = (
    "from groundstation.cli.command import Command, Group\n"
    "def wave(times: int) -> None:\n    'Wave.'\n    print('hello ' * times)\n"
    "WAVE = Command('waving:wave', 'Wave to the table.')\n"
    "MEMBERS = {'wave': WAVE, 'gone': Command('away:x', 'Gone.')}\n"
    "GREET = Group('Greet.', 'groundstation greet wave 2', MEMBERS)\n"
)


def test_a_package_adds_a_command_and_a_group(install, groundstation):
    install("waving", COMMAND, "wave = waving:WAVE\ngreet = waving:GREET")
    overview = groundstation("--help").output
    assert "wave          Wave to the table." in overview
    assert "run           Fly the vehicles of a rig, or a scenario." in overview
    assert groundstation("wave", "2").output == "hello hello \n"
    assert groundstation("greet", "wave", "1").output == "hello \n"
    assert "gone  Gone." in groundstation("greet", "--help").output


@pytest.mark.parametrize(
    ("words", "source", "value", "sentence"),
    [
        (["wave"], "import nowhere_at_all", "wave = waving:WAVE", "(ModuleNotFoundError: No module named"),
        (["wave"], "1 / 0", "wave = waving:WAVE", "(ZeroDivisionError: division by zero)"),
        (["wave"], "", "wave = waving:WAVE", "(AttributeError: "),
        (["wave"], "WAVE = 3", "wave = waving:WAVE", "waving:WAVE is no Command and no Group"),
        (
            ["greet", "gone"],
            COMMAND,
            "greet = waving:GREET",
            "away:x cannot be loaded (No module",
        ),
    ],
)
def test_a_broken_command_is_one_sentence_and_harms_no_other(
    install, groundstation, capsys, words, source, value, sentence
):
    install("waving", source, value)
    assert call(words) == 2
    reported = capsys.readouterr().err
    assert sentence in reported
    assert reported.count("\n") == 1
    overview = groundstation("--help").output
    assert "replay " in overview
    assert words[0] in overview
    assert groundstation("fusion", "--help").exit_code == 0


def test_a_command_that_two_packages_add_is_refused_by_both_names(install, capsys):
    install("waving", COMMAND, "wave = waving:WAVE")
    install("swaying", COMMAND, "wave = swaying:WAVE")
    assert call(["wave", "1"]) == 2
    assert "added by swaying and by waving" in capsys.readouterr().err


def test_a_package_cannot_take_the_place_of_a_command(install, groundstation):
    install("waving", COMMAND, "fusion = waving:WAVE")
    assert isinstance(COMMANDS["fusion"], Command | Group)
    assert "Wave" not in groundstation("fusion", "--help").output
    assert "Wave to the table" not in groundstation("--help").output
