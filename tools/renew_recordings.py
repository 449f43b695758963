"""Fly the reference recordings of `tests/replay` anew, and write down why.

    python tools/renew_recordings.py drawn_fixes --reason "the filter weighs late fixes by their age"
    python tools/renew_recordings.py --all --reason "field pose_std renamed"

A reference recording is renewed where a change was meant to change what the nodes publish; where it was not,
the failing replay has found a mistake. `renewals.toml` gets one entry per recording: kind, date, reason,
commit, software, hash, and the topics in which the recording before differed.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from groundstation.declarations.errors import UsageError
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.table import installed_tables
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.software import software
from groundstation.rig.plan import make_node
from groundstation.rig.provenance import recorded_rig
from groundstation.rig.read import parse_rig, read_text
from groundstation.runners.replay import ReplayRunner
from groundstation.runners.replay_report import ReplayReport
from groundstation.runners.tolerances import Tolerances, load_tolerances

ROOT = Path(__file__).resolve().parents[1]
HEADER = """\
# Why each reference recording was made or renewed; the last entry of a kind is that of its present file.
# Written by tools/renew_recordings.py.
"""


def main() -> None:
    """Renew what is asked for; exit with a sentence where that cannot be done."""
    parser = argparse.ArgumentParser(description="Fly reference recordings anew.")
    parser.add_argument("kinds", nargs="*", metavar="KIND", help="of tests/replay/kinds.toml")
    parser.add_argument("--all", action="store_true", help="every kind")
    parser.add_argument("--reason", required=True, help="what was meant to change, in a sentence")
    parser.add_argument("--folder", type=Path, default=ROOT / "tests" / "replay", help="of kinds.toml")
    chosen = parser.parse_args()
    reason = " ".join(chosen.reason.split())
    if not reason:
        parser.error("--reason: say what was meant to change")
    folder = chosen.folder.resolve()
    known = tomllib.loads((folder / "kinds.toml").read_text(encoding="utf-8"))
    kinds = list(known) if chosen.all else list(dict.fromkeys(chosen.kinds))
    if not kinds or (chosen.all and chosen.kinds):
        parser.error("name kinds, or give --all")
    for kind in kinds:
        if kind not in known:
            parser.error(f"no kind {kind!r} (there are {', '.join(known)})")
    os.chdir(ROOT)  # the recording's path of its rig starts here
    try:
        for kind in kinds:
            renew(folder, kind, known[kind], reason)
    except (UsageError, RecordingError) as error:
        sys.exit(str(error))


def renew(folder: Path, kind: str, recipe: dict[str, Any], reason: str) -> None:
    """Fly one kind and put its recording and its reason in place.

    Raises:
        UsageError: The rig cannot fly, or the new recording does not replay bit for bit.
    """
    target = folder / "recordings" / f"{kind}.mcap"
    changed = changed_topics(target, load_tolerances(folder / "tolerances.toml", installed_tables().payloads))
    with tempfile.TemporaryDirectory() as scratch:
        flown = Path(scratch) / target.name
        rig_path = Path(recipe["rig"])
        text = read_text(rig_path) + recipe["added"]
        rig = parse_rig(text, rig_path)
        run_lockstep(rig, text, rig_path, flown, recipe["duration_s"], recipe["seed"], lambda *_: None)
        report = replayed(flown)
        if not report.agrees:
            raise UsageError(f"{kind}: its own replay differs: {'; '.join(report.differences())}")
        target.parent.mkdir(exist_ok=True)
        shutil.copyfile(flown, target)
    entry: dict[str, object] = {
        "kind": kind,
        "date": datetime.now(UTC).date().isoformat(),
        "reason": reason,
        "commit": commit(),
        "software": software(),
        "sha256": hashlib.sha256(target.read_bytes()).hexdigest(),
        "changed_topics": changed,
    }
    log = folder / "renewals.toml"
    rows = [f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in entry.items()]
    before = log.read_text(encoding="utf-8") if log.exists() else HEADER
    log.write_text(before + "\n[[renewal]]\n" + "".join(rows), encoding="utf-8")
    print(f"{target}: {target.stat().st_size / 1e3:.0f} kB; {len(changed)} topics differed before")


def changed_topics(recording: Path, tolerances: Tolerances) -> list[str]:
    """Topics in which the recording so far differs beyond the tolerances, or why it cannot be replayed."""
    if not recording.exists():
        return []
    try:
        report = replayed(recording, tolerances)
    except (UsageError, RecordingError) as error:
        return [str(error).replace(str(recording), recording.name)]
    for sentence in report.differences():
        print(sentence)
    return [f"{result.owner}/{result.noun}" for result in report.results if not result.agrees]


def replayed(path: Path, tolerances: Tolerances = Tolerances()) -> ReplayReport:  # noqa: B008 - frozen
    """What today's nodes make of a recording."""
    with Recording(path) as recording:
        rig = recorded_rig(recording)
        return ReplayRunner(recording, lambda key: make_node(rig, key), tolerances=tolerances).run()


def commit() -> str:
    """The commit of the project, with a plus if files differ from it; empty outside a repository."""
    words = ["git", "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude", "*"]
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return ""
    return done.stdout.strip()


if __name__ == "__main__":
    main()
