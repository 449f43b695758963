"""Rows on disk: in order, whole after any crash, none missing, none twice."""

import csv
import json
import resource

import pytest

from groundstation.campaign.errors import CampaignError
from groundstation.campaign.rows import CSV, STATED, WAITING, Rows

COLUMNS = ("run", "seed", "verdict", "reason", "alpha.gas_ns")
IDENTITY = {"seed": 1}


def row(run, reason=""):
    return {
        "run": str(run), "seed": str(run * 7), "verdict": "passed", "reason": reason,
        "alpha.gas_ns": f"{run / 3:.9g}",
    }  # fmt: skip


def opened(folder, *, resume=False, columns=COLUMNS, identity=None):
    return Rows(folder, columns, IDENTITY if identity is None else identity, resume=resume)


def read(folder):
    with (folder / CSV).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_rows_stand_in_order_whatever_the_order_in_which_they_come(tmp_path):
    with opened(tmp_path) as rows:
        for run in (2, 0, 3, 1, 4):
            rows.add(run, row(run))
    assert [each["run"] for each in read(tmp_path)] == ["0", "1", "2", "3", "4"]
    assert read(tmp_path) == [row(run) for run in range(5)]
    assert not (tmp_path / WAITING).exists()


def test_what_comes_early_is_on_disk_at_once(tmp_path):
    with opened(tmp_path) as rows:
        rows.add(2, row(2))
        assert [json.loads(line)["run"] for line in (tmp_path / WAITING).read_text().splitlines()] == ["2"]
        assert read(tmp_path) == []


@pytest.mark.parametrize("reason", ["a, b", 'he said "no"', "two\nlines", "ä µ"])
def test_a_reason_is_one_cell_whatever_is_in_it(tmp_path, reason):
    with opened(tmp_path) as rows:
        rows.add(0, row(0, reason))
        rows.add(1, row(1))
    assert read(tmp_path) == [row(0, reason), row(1)]
    with opened(tmp_path, resume=True) as rows:
        assert rows.done == {0, 1}


def test_cut_at_any_byte_it_goes_on_and_is_as_if_it_had_never_been_cut(tmp_path):
    whole = tmp_path / "whole"
    with opened(whole) as rows:
        for run in range(4):
            rows.add(run, row(run, "a\nb" if run == 1 else ""))
    text = (whole / CSV).read_bytes()
    for cut in range(len(text)):
        folder = tmp_path / f"cut{cut}"
        folder.mkdir()
        (folder / STATED).write_text((whole / STATED).read_text())
        (folder / CSV).write_bytes(text[:cut])
        with opened(folder, resume=True) as rows:
            for run in set(range(4)) - rows.done:
                rows.add(run, row(run, "a\nb" if run == 1 else ""))
        assert (folder / CSV).read_bytes() == text, cut


def test_a_journal_that_is_cut_anywhere_loses_only_its_last_line(tmp_path):
    with opened(tmp_path) as rows:
        rows.add(0, row(0))
        for run in (2, 3, 4):
            rows.add(run, row(run))
    journal = (tmp_path / WAITING).read_bytes()
    (tmp_path / WAITING).write_bytes(journal[:-5])
    with opened(tmp_path, resume=True) as rows:
        assert rows.done == {0, 2, 3}
        rows.add(1, row(1))
        rows.add(4, row(4))
        assert rows.done == set(range(5))
    assert read(tmp_path) == [row(run) for run in range(5)]


def test_a_row_that_comes_twice_counts_once(tmp_path):
    with opened(tmp_path) as rows:
        for run in (0, 0, 2, 2, 1, 0):
            rows.add(run, row(run))
    assert read(tmp_path) == [row(run) for run in range(3)]


def test_a_folder_with_a_campaign_is_not_begun_again(tmp_path):
    with opened(tmp_path) as rows:
        rows.add(0, row(0))
    before = (tmp_path / CSV).read_bytes()
    with pytest.raises(CampaignError, match="--resume goes on with it"):
        opened(tmp_path)
    with pytest.raises(CampaignError, match="another campaign"):
        opened(tmp_path, resume=True, identity={"seed": 2})
    assert (tmp_path / CSV).read_bytes() == before


def test_rows_that_nobody_accounts_for_are_left_alone(tmp_path):
    (tmp_path / CSV).write_text("mine\n")
    with pytest.raises(CampaignError, match="does not say of what"):
        opened(tmp_path, resume=True)
    assert (tmp_path / CSV).read_text() == "mine\n"


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(CampaignError, match="cannot be written"):
        opened(tmp_path / "file")


def test_one_process_at_a_time_writes_the_rows(tmp_path):
    with opened(tmp_path) as rows:
        rows.add(0, row(0))
        with pytest.raises(CampaignError, match="another process flies this campaign"):
            opened(tmp_path, resume=True)
        rows.add(1, row(1))
    with opened(tmp_path, resume=True) as rows:
        assert rows.done == {0, 1}


@pytest.mark.parametrize("was_there", [True, False])
def test_a_campaign_that_flew_nothing_leaves_nothing(tmp_path, was_there):
    folder = tmp_path / "campaign"
    if was_there:
        folder.mkdir()
    with opened(folder):
        assert (folder / CSV).exists()
    assert folder.exists() == was_there
    assert not was_there or not any(folder.iterdir())


def test_what_differs_from_the_campaign_that_is_there_is_named(tmp_path):
    with opened(tmp_path, identity={"seed": 1, "rig": {"name": "a"}}) as rows:
        rows.add(0, row(0))
    with pytest.raises(CampaignError, match=r"not the same rig$"):
        opened(tmp_path, resume=True, identity={"seed": 1, "rig": {"name": "b"}})
    (tmp_path / STATED).write_bytes(b"\xff\xfe{")
    with pytest.raises(CampaignError, match="damaged"):
        opened(tmp_path, resume=True, identity={"seed": 1, "rig": {"name": "a"}})


def test_a_journal_of_noise_is_flown_again(tmp_path):
    with opened(tmp_path) as rows:
        rows.add(0, row(0))
        rows.add(2, row(2))
    with (tmp_path / WAITING).open("ab") as journal:
        journal.write(b"\xff\x00{\n")
    with opened(tmp_path, resume=True) as rows:
        assert rows.done == {0, 2}


@pytest.mark.parametrize(
    "line",
    [json.dumps({**row(4), "verdict": None}), json.dumps({**row(4), "run": "9" * 5000}), "[" * 100_000,
     json.dumps({**row(4), "run": 4})],
    ids=["no text", "many digits", "deep", "number"],
)  # fmt: skip
def test_a_line_of_the_journal_that_nobody_wrote_is_flown_again(tmp_path, line):
    with opened(tmp_path) as rows:
        rows.add(0, row(0))
    (tmp_path / WAITING).write_text(f"{line}\n")
    with opened(tmp_path, resume=True) as rows:
        assert rows.done == {0}


def test_a_row_that_is_not_right_is_flown_again_and_the_others_stay(tmp_path):
    with opened(tmp_path) as rows:
        for run in range(4):
            rows.add(run, row(run))
    whole = (tmp_path / CSV).read_bytes()
    (tmp_path / CSV).write_bytes(whole.replace(b"1,7,", b"1,8,"))
    again = Rows(tmp_path, COLUMNS, IDENTITY, resume=True, is_right=lambda row: row["seed"] != "8")
    with again as rows:
        assert rows.done == {0, 2, 3}
        rows.add(1, row(1))
    assert (tmp_path / CSV).read_bytes() == whole


def test_a_disk_that_is_full_is_one_sentence_and_the_rows_before_it_stay(tmp_path):
    def fill():
        with opened(tmp_path) as rows:
            for run in range(200):
                rows.add(run, row(run, "because " * 4))

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        with pytest.raises(CampaignError, match="make room and go on with --resume"):
            fill()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    with opened(tmp_path, resume=True) as rows:
        assert 50 < len(rows.done) < 200
        assert [each["run"] for each in read(tmp_path)] == [str(run) for run in sorted(rows.done)]
