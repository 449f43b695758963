"""The text that outlives processes: read once, overwritten in place, replaced where that is not possible."""

import json
import subprocess
import sys

import pytest

from drivers.errors import DeviceError
from drivers.memory_file import BLOCK_BYTES, MemoryFile


@pytest.fixture
def path(tmp_path):
    return tmp_path / "alpha.json"


def kept(path):
    return MemoryFile(path).read(0.0)[1:]


def test_what_was_written_last_is_read_by_the_next_one(path):
    memory = MemoryFile(path)
    assert memory.read(0.0)[1:] == ("", "")
    for text in ("a", "a longer one", "b"):
        memory.write(text)
        assert kept(path) == (text, "")
    memory.wake()


def test_the_second_read_waits_and_finds_nothing(path):
    memory = MemoryFile(path)
    memory.read(0.0)
    assert memory.read(0.01) is None


def test_it_is_overwritten_in_place_and_needs_no_new_room(path):
    memory = MemoryFile(path)
    memory.write("first")
    before = path.stat()
    memory.write("second")
    after = path.stat()
    assert (after.st_ino, after.st_size) == (before.st_ino, BLOCK_BYTES)
    memory.wake()


def test_people_can_read_it(path):
    MemoryFile(path).write(json.dumps({"mode": "stopped", "cause": "Größe"}))
    assert json.loads(path.read_text(encoding="utf-8"))["cause"] == "Größe"


@pytest.mark.parametrize("length", [BLOCK_BYTES - 1, BLOCK_BYTES, BLOCK_BYTES + 1, 3 * BLOCK_BYTES])
def test_a_text_of_any_length_is_kept_and_a_short_one_after_it(path, length):
    memory = MemoryFile(path)
    memory.write("x" * length)
    assert kept(path) == ("x" * length, "")
    memory.write("short")
    assert kept(path) == ("short", "")
    memory.write("shorter")
    assert kept(path) == ("shorter", "")
    assert path.stat().st_size == BLOCK_BYTES


def test_a_file_that_was_removed_is_made_again(path):
    memory = MemoryFile(path)
    memory.write("first")
    path.unlink()
    memory.write("second")
    assert kept(path) == ("second", "")


def test_it_survives_the_death_of_its_process(path):
    script = (
        "import os, sys, signal, pathlib; from drivers.memory_file import MemoryFile;"
        "memory = MemoryFile(pathlib.Path(sys.argv[1]));"
        "[memory.write(f'text {number}') for number in range(100)];"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run([sys.executable, "-c", script, str(path)], check=False)
    assert done.returncode == -9
    assert kept(path) == ("text 99", "")


def test_what_cannot_be_read_or_written_is_said(path):
    path.write_bytes(b"\xff\xfe")
    assert "cannot be read" in kept(path)[1]
    gone = MemoryFile(path.parent / "nowhere" / "alpha.json")
    with pytest.raises(DeviceError, match="cannot be written: No such file"):
        gone.write("text")


def test_a_write_that_is_cut_short_is_none(path):
    """A limit or a full disk may take a part of a block and call that a success."""
    script = (
        "import pathlib, resource, sys; from drivers.errors import DeviceError;"
        "from drivers.memory_file import MemoryFile\n"
        "memory = MemoryFile(pathlib.Path(sys.argv[1]))\n"
        "memory.write('x' * 500)\n"
        "before = resource.getrlimit(resource.RLIMIT_FSIZE)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))\n"
        "for _ in '12':\n"
        "    try:\n"
        "        memory.write('y' * 500)\n"
        "    except DeviceError as error:\n"
        "        print(error)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, before)\n"
        "memory.write('y' * 500)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)], check=True, capture_output=True, text=True
    )
    lines = done.stdout.splitlines()
    assert len(lines) == 2
    assert all("cannot be written: No space left on device" in line for line in lines)
    assert kept(path) == ("y" * 500, "")
