import pytest

from groundstation.declarations.errors import UsageError
from groundstation.launch.guided import load_wizard

RIG = "examples/rigs/drawn_fixes.toml"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("imu", RIG, "--out", "x.toml"), "--guided"),
        (("imu", RIG, "--guided", "--vehicle", "nobody", "--out", "x.toml"), "no vehicle 'nobody'"),
        (("guided", "imu", RIG, "--vehicle", "nobody", "--out", "x.toml"), "no vehicle 'nobody'"),
        (("guided", "hull", RIG, "--out", "x.toml"), "no guided calibration 'hull'; installed: imu, lens"),
        (("guided", "mount", RIG, "--out", "x.toml"), "alpha cannot be calibrated so: it has no star camera"),
    ],
)
def test_what_is_missing_is_said_before_anything_is_touched(
    groundstation, pytestconfig, monkeypatch, arguments, words
):
    monkeypatch.chdir(pytestconfig.rootpath)
    with pytest.raises(UsageError, match=words):
        groundstation("calibrate", *arguments)


def test_a_wizard_of_a_package_is_found_and_a_broken_one_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "weighing.py").write_text("class Weigh:\n    summary = 'Mass.'\nWIZARD = Weigh()\n")
    info = tmp_path / "weighing-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: weighing\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[groundstation.wizards]\nweigh = weighing:WIZARD\nbroken = nowhere_at_all:WIZARD\n"
    )
    assert load_wizard("weigh").summary == "Mass."
    assert "slope" in load_wizard("imu").summary
    with pytest.raises(
        UsageError, match=r"'broken' cannot be loaded \(No module named 'nowhere_at_all'\)\.$"
    ):
        load_wizard("broken")
