"""What is no file is refused before it is read: a pipe would wait for ever, a device has no end."""

import os
from pathlib import Path

import pytest

from drivers.files.errors import FileError
from drivers.files.reading import open_file, read_bytes
from groundstation.cli.main import call
from groundstation.declarations.errors import RigError
from groundstation.rig.read import read_text


@pytest.fixture(params=["a pipe", "a device"])
def no_file(request, tmp_path):
    path = tmp_path / "run.mcap"
    if request.param == "a pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")
    return path, f"it is {request.param}, expected a file"


def test_a_file_is_opened_and_a_folder_has_the_sentence_of_the_system(tmp_path):
    (tmp_path / "a").write_bytes(b"12")
    (tmp_path / "link").symlink_to("a")
    with open_file(tmp_path / "link") as file:
        assert file.read() == b"12"
    with pytest.raises(IsADirectoryError):
        open_file(tmp_path)


def test_what_is_no_file_is_named_for_what_it_is(no_file):
    path, words = no_file
    with pytest.raises(FileError, match=words):
        read_bytes(path)
    with pytest.raises(RigError, match=words):
        read_text(path)


@pytest.mark.parametrize(
    "words",
    [
        ["recording", "info", "{}"],
        ["recording", "recover", "{}", "--out", "new.mcap"],
        ["replay", "{}"],
        ["replay", str(Path(__file__).parents[3] / "replay/recordings/formation.mcap"), "--tolerances", "{}"],
        ["run", "{}", "--lockstep", "--duration", "1"],
        ["relative", "centroids", "{}", "--out", "x.csv"],
        ["relative", "tle", "{}", "--out", "x.csv"],
        ["calibrate", "delay", "{}", "--out", "x.toml"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_every_command_refuses_it(words, no_file, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path, said = no_file
    assert call([word.format(path) for word in words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"groundstation: {path}")
    assert said in line
