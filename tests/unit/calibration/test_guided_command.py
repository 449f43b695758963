import pytest

from groundstation.declarations.errors import UsageError

RIG = "examples/rigs/drawn_fixes.toml"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("imu", RIG, "--out", "x.toml"), "--guided"),
        (("imu", RIG, "--guided", "--vehicle", "nobody", "--out", "x.toml"), "no vehicle 'nobody'"),
        (("guided", "imu", RIG, "--vehicle", "nobody", "--out", "x.toml"), "no vehicle 'nobody'"),
        (("guided", "lens", RIG, "--out", "x.toml"), "no guided calibration 'lens'; installed: imu"),
    ],
)
def test_what_is_missing_is_said_before_anything_is_touched(
    groundstation, pytestconfig, monkeypatch, arguments, words
):
    monkeypatch.chdir(pytestconfig.rootpath)
    with pytest.raises(UsageError, match=words):
        groundstation("calibrate", *arguments)
