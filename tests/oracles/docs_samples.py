"""The samples of the documentation: blocks of code by page, kind and line, and what is known not to run."""

import re
import shlex
import tomllib
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "examples/own_package/README.md", *sorted((ROOT / "docs").rglob("*.md"))]
NOT_RUN = tomllib.loads((ROOT / "tests/examples/samples_not_run.toml").read_text(encoding="utf-8"))
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SHELL = ("sh", "bash", "console")
OURS = ("groundstation", "python", "make")


class Sample(NamedTuple):
    """A block of code of a page."""

    page: Path
    line: int
    kind: str
    text: str

    @property
    def name(self):
        return f"{self.page.relative_to(ROOT)}:{self.line}"

    @property
    def first(self):
        return self.text.lstrip().partition("\n")[0].strip()

    @property
    def reason(self):
        """Why it is not run; empty if it is."""
        page = self.page.relative_to(ROOT).as_posix()
        return next(
            (
                row["because"]
                for row in NOT_RUN["sample"]
                if (row["page"], row["first"]) == (page, self.first)
            ),
            "",
        )


def samples_of(page):
    """Blocks between fences; those that are indented are read as blocks of commands."""
    text = page.read_text(encoding="utf-8")
    for found in FENCE.finditer(text):
        line = text.count("\n", 0, found.start()) + 1
        kind = found[1] or ("shell" if is_shell(found[2]) else "text")
        yield Sample(page, line, "shell" if kind in SHELL else kind, found[2])
    rest = FENCE.sub(lambda found: "\n" * found[0].count("\n"), text)
    for number, line in enumerate(rest.splitlines(), 1):
        if re.match(r"(?: {4,}|\t)\S*(?:groundstation|python) ", line):
            yield Sample(page, number, "shell", line)


def is_shell(text):
    """Whether a block without a language is one of commands: its first line is."""
    words = text.lstrip().partition("\n")[0].split()
    return bool(words) and words[0][-1] != "/" and program(words[0]) in (*OURS, *NOT_RUN["programs"])


def program(word):
    """What a word starts, wherever it lies."""
    return re.sub(r"[\d.]+$", "", Path(word).name)


def commands_of(text):
    """Words of each command of a block of commands."""
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words:
            yield words


ALL = [sample for page in PAGES for sample in samples_of(page)]
