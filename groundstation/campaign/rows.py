"""Rows of a campaign on disk: in order, each there as soon as its run is over, none twice.

``runs.csv`` holds the rows in order. Runs that are over before an earlier one wait in ``unordered.jsonl``
beside it, which is gone when all are in order. A line that a crash has torn, or that somebody has edited into
what no run can be, is flown again; the others stay.
"""

import contextlib
import csv
import fcntl
import io
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Self, TextIO

from groundstation.campaign.errors import CampaignError
from groundstation.campaign.flying import Row
from groundstation.campaign.known_rows import NUMBER, rows_of, text_of, waiting_rows
from groundstation.files.errors import FileError
from groundstation.files.writing import write_file

CSV, WAITING, STATED = "runs.csv", "unordered.jsonl", "campaign.json"


class Rows:
    """The rows of a folder; use it as a context manager.

    Args:
        folder: Of the campaign; made if it is not there.
        columns: Of the rows.
        identity: What has to be equal for a campaign to be continued.
        resume: Whether one that is there is continued.
        is_right: Whether a row that is there is one of this campaign.

    Raises:
        CampaignError: There is a campaign, and it is not to be continued or is another one; or the folder
            cannot be written.
    """

    def __init__(
        self,
        folder: Path,
        columns: tuple[str, ...],
        identity: Mapping[str, object],
        *,
        resume: bool,
        is_right: Callable[[Row], bool] = lambda row: True,
    ) -> None:
        self._folder = folder
        self._is_right = is_right
        self._columns = columns
        self._waiting: dict[int, Row] = {}
        self._next = 0
        stated = json.dumps(identity, sort_keys=True, indent=1, default=str) + "\n"
        with contextlib.ExitStack() as kept:
            self._begin(stated, kept, resume=resume)
            self._kept = kept.pop_all()

    def _begin(self, stated: str, kept: contextlib.ExitStack, *, resume: bool) -> None:
        folder = self._folder
        try:
            self._is_new = not folder.exists()
            folder.mkdir(parents=True, exist_ok=True)
            kept.callback(os.close, _locked(folder))
            self._check(stated, resume=resume)
            known = self._known() if resume else {}
            write_file(folder / STATED, stated)
            self._csv = self._begun(known)
            self._journal: TextIO | None = None
            for run, row in known.items():
                if run >= self._next:
                    self._waiting[run] = row
            self._rewrite_journal()
        except (OSError, FileError) as error:
            reason = error.strerror if isinstance(error, OSError) and error.strerror else error
            raise CampaignError(f"{folder}: cannot be written ({reason})") from error

    @property
    def done(self) -> set[int]:
        """Runs that have been flown."""
        return {*range(self._next), *self._waiting}

    def add(self, run: int, row: Row) -> None:
        """Keep the row of a run that is over: on disk when this returns.

        Raises:
            CampaignError: The disk is full, or gone.
        """
        if run < self._next or run in self._waiting:
            return
        try:
            self._waiting[run] = row
            if run != self._next:
                self._put_journal(run, row)
                return
            while self._next in self._waiting:
                self._csv.write(self._line(self._waiting.pop(self._next)))
                self._next += 1
            _to_disk(self._csv)
            if not self._waiting:
                self._drop_journal()
        except OSError as error:
            raise CampaignError(
                f"{self._folder / CSV} cannot be written any further ({error.strerror}): make room and go on "
                "with --resume"
            ) from error

    def read(self) -> list[Row]:
        """The rows in order."""
        return [row for _, row in self._among(rows_of(self._folder / CSV, self._columns))]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for file in (self._csv, self._journal):
            with contextlib.suppress(OSError):  # what a full disk did not take, ``add`` has reported
                if file is not None:
                    file.close()
        if not self.done:  # nothing was flown: another try finds nothing in its way
            for name in (CSV, STATED):
                (self._folder / name).unlink(missing_ok=True)
            if self._is_new:
                with contextlib.suppress(OSError):  # somebody has put something there
                    self._folder.rmdir()
        self._kept.close()

    # -- what was there before ------------------------------------------------------------------------

    def _check(self, stated: str, *, resume: bool) -> None:
        path = self._folder / STATED
        if not path.exists():
            if any((self._folder / name).exists() for name in (CSV, WAITING)):
                raise CampaignError(
                    f"{self._folder} holds rows, but does not say of what: choose another folder"
                )
            return
        if not resume:
            raise CampaignError(f"{self._folder} holds a campaign: --resume goes on with it")
        differ = _differences(text_of(path), json.loads(stated))
        if differ:
            raise CampaignError(
                f"{self._folder} holds another campaign, by {STATED} in it: not the same {', '.join(differ)}"
            )

    def _known(self) -> dict[int, Row]:
        known = dict(self._among(rows_of(self._folder / CSV, self._columns)))
        for run, row in self._among(waiting_rows(self._folder / WAITING, self._columns)):
            known.setdefault(run, row)
        return known

    def _among(self, rows: Iterable[Row]) -> Iterator[tuple[int, Row]]:
        """Those that are of this campaign, with their numbers."""
        for row in rows:
            if NUMBER.fullmatch(row["run"]) and self._is_right(row):
                yield int(row["run"]), row

    def _begun(self, known: Mapping[int, Row]) -> TextIO:
        """The file with the rows that are in order, written anew."""
        ordered = []
        while self._next in known:
            ordered.append(self._line(known[self._next]))
            self._next += 1
        path = self._folder / CSV
        write_file(path, self._line(dict(zip(self._columns, self._columns, strict=True))) + "".join(ordered))
        return path.open("a", encoding="utf-8", newline="")

    # -- the journal ----------------------------------------------------------------------------------

    def _put_journal(self, run: int, row: Row) -> None:
        if self._journal is None:
            self._journal = (self._folder / WAITING).open("a", encoding="utf-8")
        self._journal.write(json.dumps(row) + "\n")
        _to_disk(self._journal)
        assert row["run"] == str(run)

    def _rewrite_journal(self) -> None:
        self._drop_journal()
        for run, row in sorted(self._waiting.items()):
            self._put_journal(run, row)

    def _drop_journal(self) -> None:
        if self._journal is not None:
            self._journal.close()
            self._journal = None
        (self._folder / WAITING).unlink(missing_ok=True)

    def _line(self, row: Row) -> str:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(row[name] for name in self._columns)
        return text.getvalue()


def _locked(folder: Path) -> int:
    """Hold a folder for this process alone; what to close to give it back.

    Raises:
        CampaignError: Another process writes there.
    """
    held = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(held)
        raise CampaignError(
            f"{folder}: another process flies this campaign (one that was suspended goes on with 'fg')"
        ) from error
    except OSError:
        return held  # a file system without locks
    return held


def _differences(text: str, stated: Mapping[str, object]) -> list[str]:
    """What is not the same in two statements of what a campaign is of."""
    try:
        found = json.loads(text)
    except ValueError:
        found = None
    if not isinstance(found, dict):
        return ["statement: it is damaged"]
    return [name for name in stated if name not in found or found[name] != stated[name]]


def _to_disk(file: TextIO) -> None:
    file.flush()
    os.fsync(file.fileno())
