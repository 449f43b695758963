from importlib.metadata import EntryPoint

import pytest

from drivers.errors import NotFound
from drivers.laboratory import (
    Arrival,
    ChannelKind,
    Laboratory,
    encode_announcement,
    load_laboratory,
    parse_announcement,
)
from drivers.laboratory import channels as laboratory

ADDRESSES = {
    "alpha/imu": "/dev/pts/3",
    "alpha/star_camera": "http://127.0.0.1:4711/alpha.raw",
    "valve_bus": {"interface": "slcan", "channel": "socket://127.0.0.1:4712", "bitrate": 500000},
}


class Quiet:
    """A laboratory in which nothing happens."""

    def __init__(self, config, seed):
        self.config, self.seed = config, seed

    def channels(self):
        return {"alpha/imu": ChannelKind.BYTES}

    def next_arrival_ns(self):
        return None

    def advance(self, stamp_ns):
        return [Arrival(stamp_ns, "alpha/imu", b"")]

    def deliver(self, stamp_ns, channel, data):
        pass

    def close(self):
        pass


def broken(config, seed):
    return object()


@pytest.fixture
def installed(monkeypatch):
    points = [
        EntryPoint("quiet", f"{__name__}:Quiet", laboratory.ENTRY_POINT_GROUP),
        EntryPoint("broken", f"{__name__}:broken", laboratory.ENTRY_POINT_GROUP),
        EntryPoint("gone", "no_such_room.laboratory:Gone", laboratory.ENTRY_POINT_GROUP),
    ]
    found = {point.name: point for point in points}
    values = {"quiet": Quiet, "broken": broken}

    class Installed:
        def __init__(self, point):
            self.name, self.value = point.name, point.value

        def load(self):
            if self.name == "gone":
                return found["gone"].load()
            return values[self.name]

    monkeypatch.setattr(laboratory, "entry_points", lambda group: [Installed(point) for point in points])


@pytest.mark.usefixtures("installed")
def test_a_laboratory_is_made_by_its_name_with_config_and_seed():
    made = load_laboratory("quiet", {"table": "flat"}, seed=7)
    assert isinstance(made, Laboratory)
    assert (made.config, made.seed) == ({"table": "flat"}, 7)


@pytest.mark.usefixtures("installed")
def test_a_laboratory_that_is_not_installed_or_cannot_be_loaded_is_not_found():
    with pytest.raises(NotFound, match=r"'nowhere' is installed \(installed: broken, gone, quiet\)"):
        load_laboratory("nowhere", {}, 0)
    with pytest.raises(NotFound, match="no_such_room"):
        load_laboratory("gone", {}, 0)


@pytest.mark.usefixtures("installed")
def test_what_is_no_laboratory_is_refused():
    with pytest.raises(TypeError, match="no Laboratory"):
        load_laboratory("broken", {}, 0)


def test_an_announcement_survives_its_line():
    line = encode_announcement(ADDRESSES)
    assert line.endswith("\n")
    assert line.count("\n") == 1
    assert parse_announcement(line) == ADDRESSES


@pytest.mark.parametrize("line", ["", "ready\n", '{"level": "info"}', "[1]", "3"])
def test_other_lines_are_no_announcement(line):
    assert parse_announcement(line) is None


@pytest.mark.parametrize("line", ['{"announce": 3}', '{"announce": {"alpha/imu": 3}}'])
def test_a_malformed_announcement_is_refused(line):
    with pytest.raises(ValueError, match="announce"):
        parse_announcement(line)
