"""Numbers that nobody can mean are refused in a sentence, whichever command takes them."""

from pathlib import Path

import pytest

from groundstation.cli.main import call

RECORDING = Path(__file__).parents[3] / "replay" / "recordings" / "formation.mcap"
HUGE = "1" + "0" * 400


def refused(capsys, *words):
    """The words of a refusal, on one line."""
    assert call([str(word) for word in words]) == 2
    reported = capsys.readouterr().err
    assert "Traceback" not in reported
    return " ".join(reported.split())


@pytest.mark.parametrize("value", ["1e308", HUGE, "nan", "inf", "-1"])
@pytest.mark.parametrize("option", ["--from-s", "--to-s"])
@pytest.mark.parametrize(
    ("command", "out", "more"),
    [("cut", "x.mcap", []), ("film", "x.avi", []), ("plot", "x.png", ["alpha/state.heading_rad"])],
)
def test_a_moment_of_a_recording_is_a_time_that_recordings_have(
    command, out, more, option, value, tmp_path, capsys
):
    words = ["recording", command, RECORDING, *more, "--out", tmp_path / out, f"{option}={value}"]
    assert option in refused(capsys, *words)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("command", "out", "more"),
    [("cut", "x.mcap", []), ("film", "x.avi", []), ("plot", "x.png", ["alpha/state.heading_rad"])],
)
@pytest.mark.parametrize("span", [(4, 2), (3, 3), (1e7, None), (0, 0)])
def test_a_stretch_that_holds_nothing_is_named(command, out, more, span, tmp_path, capsys):
    words = ["recording", command, RECORDING, *more, "--out", tmp_path / out, "--from-s", span[0]]
    said = refused(capsys, *words, *([] if span[1] is None else ["--to-s", span[1]]))
    assert "nothing" in said
    assert f"{span[0]:g}" in said
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "option", "value"),
    [
        (["calibrate", "survey", "x", "--out", "y"], "--tape-std-mm", "1e308"),
        (["calibrate", "board", "x", "--out", "y"], "--square-mm", "1e308"),
        (["calibrate", "mount", "x", "--out", "y"], "--first-heading-deg", "1e308"),
        (["calibrate", "delay", "x", "--out", "y"], "--guess-s", "-1"),
        (["calibrate", "tilt", "x", "--out", "y"], "--least-s", "0"),
        (["calibrate", "zero-offset-fit", "x", "--end-s", "3", "--out", "y"], "--start-s", "1e308"),
        (["relative", "target", "x.png", "--out", "y"], "--tip-diameter-m", "1e308"),
        (["relative", "target", "x.png", "--out", "y"], "--f-px", "1e-300"),
        (["inject", "alpha", "stuck_open_valve"], "--for", HUGE),
        (["demo", "data", "x"], "--seed", HUGE),
        (["campaign", "x.toml", "--runs", "1", "--out", "y"], "--seed", HUGE),
        (["devices", "/dev/null"], "--baud", HUGE),
    ],
    ids=lambda given: None if isinstance(given, list) else given[:8],
)
def test_what_nobody_can_mean_is_refused_before_anything_is_read(words, option, value, tmp_path, capsys):
    assert option in refused(capsys, *words, f"{option}={value}")


def test_the_number_of_a_message_is_no_option(capsys):
    assert "sequence" in refused(capsys, "recording", "causes", RECORDING, "alpha", "state", "0")


@pytest.mark.parametrize("more", [["--squares", f"{HUGE}x6"], ["--squares", "9x6", "--marker-mm", "1e-300"]])
def test_a_board_is_one_that_can_be_printed(more, tmp_path, capsys):
    (tmp_path / "frames").mkdir()
    said = refused(capsys, "calibrate", "board", tmp_path, "--out", tmp_path / "x.toml", *more)
    assert "a board has at most 100 x 100 squares" in said or "at least 0.1 mm" in said
