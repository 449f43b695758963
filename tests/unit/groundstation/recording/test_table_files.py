"""Topics as CSV and Parquet: the same numbers, units in the names of columns."""

import csv
from pathlib import Path

import numpy as np
import pytest

import groundstation.recording
from groundstation.cli.main import call

SOURCE = Path(__file__).parents[3] / "replay" / "recordings" / "formation.mcap"


def rows(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_csv_file_holds_every_row_and_number(tmp_path, capsys):
    words = ["recording", "export", str(SOURCE), "--csv", str(tmp_path / "t")]
    assert call([*words, "--topic", "alpha/state", "--topic", "/beta/supervision"]) == 0
    assert "alpha_state.csv: 406 rows, 7 fields" in capsys.readouterr().out
    assert sorted(path.name for path in (tmp_path / "t").iterdir()) == [
        "alpha_state.csv",
        "beta_supervision.csv",
    ]
    found = rows(tmp_path / "t" / "alpha_state.csv")
    with groundstation.recording.open(SOURCE) as recording:
        table = recording["alpha/state"]
        assert [int(row["stamp_ns"]) for row in found] == table.stamp_ns.tolist()
        assert [float(row["stamp_s"]) for row in found] == table.stamp_s.tolist()
        assert [float(row["position_table_m[1]"]) for row in found] == table.position_table_m[:, 1].tolist()
        modes = [row["mode"] for row in rows(tmp_path / "t" / "beta_supervision.csv")]
        assert modes == recording["beta/supervision"]["mode"].tolist()


def test_every_topic_is_exported_and_bytes_are_named_as_left_out(tmp_path, capsys):
    assert call(["recording", "export", str(SOURCE), "--csv", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "lockstep_journal.csv" in shown
    assert "without entries: bytes have no place in CSV" in shown
    with groundstation.recording.open(SOURCE) as recording:
        assert len(list(tmp_path.glob("*.csv"))) == len(recording.topics_without_pictures) > 40
        for topic in recording.topics_without_pictures:
            assert len(rows(tmp_path / f"{topic.replace('/', '_')}.csv")) == len(recording[topic])


def test_a_parquet_file_holds_the_same(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    assert call(["recording", "export", str(SOURCE), "--parquet", str(tmp_path)]) == 0
    found = parquet.read_table(tmp_path / "alpha_state.parquet")
    journal = parquet.read_table(tmp_path / "lockstep_journal.parquet")
    with groundstation.recording.open(SOURCE) as recording:
        table = recording["alpha/state"]
        np.testing.assert_array_equal(found["position_table_m[0]"].to_numpy(), table.position_table_m[:, 0])
        assert journal["entries"].to_pylist() == recording["lockstep/journal"]["entries"].tolist()
        assert [tuple(x) for x in journal["names"].to_pylist()] == recording["lockstep/journal"][
            "names"
        ].tolist()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "give one of --csv, --parquet and --fusion-folder"),
        (["--csv", "a", "--parquet", "b"], "give one of --csv, --parquet and --fusion-folder"),
        (["--csv", "a", "--topic", "alpha/stat"], "did you mean alpha/state"),
        (["--csv", "a", "--vehicle", "alpha"], "--vehicle goes with --fusion-folder"),
        (["--csv", "a", "--rig", "rig.toml"], "--rig goes with --fusion-folder"),
        (["--fusion-folder", "a", "--topic", "alpha/imu"], "--topic goes with --csv or --parquet"),
    ],
)
def test_wrong_words_are_refused_in_one_sentence(words, sentence, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert call(["recording", "export", str(SOURCE), *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert sentence in line
    assert not list(tmp_path.iterdir())


def test_without_pyarrow_the_extra_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("groundstation.recording.table_files.find_spec", lambda _name: None)
    assert call(["recording", "export", str(SOURCE), "--parquet", str(tmp_path / "t")]) == 2
    assert "pip install 'groundstation[cluster]'" in capsys.readouterr().err
    assert not (tmp_path / "t").exists()
