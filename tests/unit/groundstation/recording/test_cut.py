"""A cut is a recording: what lies in the stretch, and what was latched before it."""

from pathlib import Path

import pytest

from groundstation.cli.main import call
from groundstation.parts.table import installed_tables
from groundstation.recording.cut import CUT_NAME, cut
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.recording_file import RecordingFile

SOURCE = Path(__file__).parents[3] / "replay" / "recordings" / "formation.mcap"
KINDS = installed_tables().payloads.values()
LATCHED = [kind for kind in KINDS if kind.TOPIC.latched]


def silent(*_):
    pass


def of(message):
    return message.envelope[:4], message.data, message.log_ns


def test_a_cut_holds_the_stretch_and_what_was_latched_before(tmp_path):
    target = tmp_path / "cut.mcap"
    count = cut(SOURCE, target, (2.0, 4.0), LATCHED, silent)
    with Recording(SOURCE) as source, Recording(target) as found:
        low_ns, high_ns = source.start_ns + 2_000_000_000, source.start_ns + 4_000_000_000
        inside = [of(m) for m in source.messages(KINDS, start_ns=low_ns, stop_ns=high_ns)]
        before = source.newest(LATCHED, low_ns - 1)
        assert before
        messages = [of(m) for m in found.messages(KINDS)]
        assert len(messages) == count == len(inside) + len(before)
        carried = [(envelope, data, low_ns) for envelope, data, _ in map(of, before)]
        assert sorted(messages[: len(before)], key=str) == sorted(carried, key=str)
        assert messages[len(before) :] == inside
        assert found.info == source.info
        assert found.start_ns == low_ns


def test_it_says_what_it_was_cut_from(tmp_path):
    cut(SOURCE, tmp_path / "cut.mcap", (1.0, None), LATCHED, silent)
    assert CUT_NAME.encode() in (tmp_path / "cut.mcap").read_bytes()
    file = RecordingFile(tmp_path / "cut.mcap")
    assert len(file.summary.metadata_places) == 2
    file.close()


def test_a_cut_from_the_beginning_to_the_end_is_the_recording(tmp_path):
    cut(SOURCE, tmp_path / "cut.mcap", (0.0, None), LATCHED, silent)
    with Recording(SOURCE) as source, Recording(tmp_path / "cut.mcap") as found:
        assert list(map(of, found.messages(KINDS))) == list(map(of, source.messages(KINDS)))


@pytest.mark.parametrize("span", [(100.0, None), (3.0, 3.0), (4.0, 2.0)])
def test_a_stretch_without_anything_is_refused_and_leaves_no_file(tmp_path, span):
    with pytest.raises(RecordingError, match=r"is 6\.0 s long: there is nothing from"):
        cut(SOURCE, tmp_path / "cut.mcap", span, LATCHED, silent)
    assert not list(tmp_path.iterdir())


def test_the_newest_of_each_channel_is_what_was_known_then():
    with Recording(SOURCE) as recording:
        everything = list(recording.messages(KINDS))
        for share in (0.0, 0.1, 0.5, 0.99, 1.0):
            at_ns = recording.start_ns + round(share * (recording.stop_ns - recording.start_ns))
            want = {}
            for message in everything:
                if message.log_ns <= at_ns:
                    want[message.envelope.topic.noun, message.envelope.owner] = of(message)
            assert sorted(map(of, recording.newest(KINDS, at_ns)), key=str) == sorted(want.values(), key=str)


def test_the_commands_cut_plot_and_export(tmp_path, capsys):
    out = tmp_path / "cut.mcap"
    assert call(["recording", "cut", str(SOURCE), "--from-s", "2", "--to-s", "3", "--out", str(out)]) == 0
    assert call(["recording", "info", str(out)]) == 0
    assert "1.0 s" in capsys.readouterr().out
    fields = ["alpha/state.position_table_m", "beta/wrench.force_x_n"]
    assert call(["recording", "plot", str(out), *fields, "--out", str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert "position_table_m[1]" in capsys.readouterr().out
    assert (
        call(["recording", "plot", str(out), "alpha/stat.heading_rad", "--out", str(tmp_path / "b.png")]) == 2
    )
    assert "did you mean alpha/state" in capsys.readouterr().err
    assert not (tmp_path / "b.png").exists()
    words = ["recording", "plot", str(out), "alpha/state.heading_rad", "--from-s", "50"]
    assert call([*words, "--out", str(tmp_path / "b.png")]) == 2
    assert "nothing of alpha/state.heading_rad lies between" in capsys.readouterr().err
