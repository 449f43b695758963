import pytest
from typer.testing import CliRunner

from groundstation.cli.calibrate import app
from groundstation.cli.errors import UsageError

RIG = "examples/rigs/drawn_fixes.toml"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("imu", RIG, "--out", "x.toml"), "--guided"),
        (("imu", RIG, "--guided", "--vehicle", "nobody", "--out", "x.toml"), "no vehicle 'nobody'"),
    ],
)
def test_what_is_missing_is_said_before_anything_is_touched(pytestconfig, monkeypatch, arguments, words):
    monkeypatch.chdir(pytestconfig.rootpath)
    result = CliRunner().invoke(app, list(arguments))
    assert isinstance(result.exception, UsageError), result.output
    assert words in str(result.exception)
