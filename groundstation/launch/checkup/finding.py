"""What a check finds: whether it is well, in words, and what a person can do."""

import grp
import os
from dataclasses import dataclass
from enum import Enum
from pathlib import Path


class Verdict(Enum):
    """How bad it is."""

    OK = "OK"
    WARN = "WARN"  # it flies, worse than it could
    BAD = "BAD"  # it will not fly


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of a checkup.

    Attributes:
        verdict: How bad it is.
        subject: What was looked at.
        what: What was found.
        advice: What to do; empty where it is well.
    """

    verdict: Verdict
    subject: str
    what: str
    advice: str = ""


def ok(subject: str, what: str) -> Finding:
    """It is well."""
    return Finding(Verdict.OK, subject, what)


def warn(subject: str, what: str, advice: str) -> Finding:
    """It flies, worse than it could."""
    return Finding(Verdict.WARN, subject, what, advice)


def bad(subject: str, what: str, advice: str) -> Finding:
    """It will not fly."""
    return Finding(Verdict.BAD, subject, what, advice)


@dataclass(frozen=True, slots=True)
class Machine:
    """A machine as its files show it.

    Attributes:
        root: Where its file system begins: ``/``, or a folder with copies of its files.
        uid: Of the user who will fly.
        groups: Numbers of his groups.
    """

    root: Path
    uid: int
    groups: frozenset[int]

    @classmethod
    def of_process(cls, root: Path) -> "Machine":
        """This one, and the user of this process."""
        return cls(root, os.geteuid(), frozenset({os.getegid(), *os.getgroups()}))

    def at(self, path: str) -> Path:
        """A file of the machine by its absolute path."""
        return self.root / path.lstrip("/")

    def text(self, path: str) -> str | None:
        """What a file of a line or two says; None where there is none that can be read."""
        try:
            return self.at(path).read_text(encoding="utf-8", errors="replace").strip()
        except OSError:
            return None

    def may_use(self, path: Path) -> bool:
        """Whether the user may read and write a file, by its owner, group and mode."""
        if self.uid == 0:
            return True
        found = path.stat()
        shift = 6 if found.st_uid == self.uid else 3 if found.st_gid in self.groups else 0
        return found.st_mode >> shift & 0o6 == 0o6


def group_of(path: Path) -> str:
    """Name of a file's group; its number where it has no name."""
    number = path.stat().st_gid
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)


def permission(machine: Machine, subject: str, path: Path, shown: str) -> Finding | None:
    """What is wrong with using a device: it is not there, or may not be used; None if it may."""
    if not path.exists():
        return bad(subject, f"{shown} is not there", "plug it in, or correct the address in the rig file")
    if not machine.may_use(path):
        group = group_of(path)
        return bad(
            subject,
            f"{shown} may not be read and written: it belongs to the group {group}",
            f"sudo usermod -aG {group} $USER, then log in again",
        )
    return None
