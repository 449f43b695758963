"""Mutation run over the safety path: small changes that a test must notice, one at a time.

Each mutant is compiled in memory by an import hook of a process of its own, which then runs the tests that
``tools/mutate_targets.toml`` lists for its file; the checkout is never edited. A mutant that all tests pass
has survived: it is listed with its line. Those that change nothing that anybody could observe stand in the
same file with the reason, and count neither way.

Usage: python tools/mutate.py --sample 200 --seed 1
"""

import argparse
import contextlib
import importlib.abc
import importlib.machinery
import importlib.util
import io
import multiprocessing
import os
import random
import re
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path

from mutate_operators import Mutant, mutants_of

ROOT = Path(__file__).parents[1]
TARGETS = Path(__file__).with_name("mutate_targets.toml")
BEGIN, END = "<!-- mutants:begin -->", "<!-- mutants:end -->"
PROFILE = "mutants"
IGNORED = ("-W", "ignore::pytest.PytestAssertRewriteWarning")  # of what is imported before the fork
KILLED, SURVIVED, TIMED_OUT, EQUIVALENT = "killed", "survived", "timed out", "equivalent"


@dataclass(frozen=True)
class Targets:
    """What is mutated and by what it is judged.

    Attributes:
        tests: Per file, paths of tests.
        equivalents: Reasons by file, original and changed text.
    """

    tests: dict[str, list[str]]
    equivalents: dict[tuple[str, str, str], str]

    @classmethod
    def read(cls) -> "Targets":
        """The targets as the file states them."""
        given = tomllib.loads(TARGETS.read_text(encoding="utf-8"))
        rows = given.get("equivalent", [])
        return cls(
            given["tests"],
            {(row["file"], row["before"], row["after"]): row["why"] for row in rows},
        )


class _Finder(importlib.abc.MetaPathFinder):
    """Hands out the mutant in place of its module."""

    def __init__(self, module: str, mutant: Mutant) -> None:
        self._module, self._mutant = module, mutant

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: object = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != self._module:
            return None
        loader = _Loader(fullname, str(ROOT / self._mutant.file))
        loader.mutant = self._mutant
        return importlib.util.spec_from_file_location(fullname, loader.path, loader=loader)


class _Loader(importlib.machinery.SourceFileLoader):
    mutant: Mutant

    def get_code(self, fullname: str) -> object:  # type: ignore[override]
        return compile(self.mutant.tree(), self.path, "exec")


def judge(mutant: Mutant | None, tests: list[str]) -> None:
    """Run tests against a mutant, in a process of its own; the exit code is that of pytest."""
    os.setpgid(0, 0)
    sys.path.insert(0, str(ROOT))
    os.chdir(ROOT)
    if mutant is not None:
        module = mutant.file.removesuffix(".py").replace("/", ".")
        assert module not in sys.modules
        sys.meta_path.insert(0, _Finder(module, mutant))
    import pytest

    words = [
        "-q",
        "-x",
        "-n",
        "0",
        "-p",
        "no:cacheprovider",
        "--no-header",
        "--tb=no",
        f"--hypothesis-profile={PROFILE}",
        *IGNORED,
    ]
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            code = int(pytest.main([*words, *tests]))
    os._exit(code)


def run(mutants: list[Mutant], targets: Targets, jobs: int, timeout_s: float) -> Iterator[tuple[Mutant, str]]:
    """Judge mutants, some at a time; each with what became of it, in the order in which that is known."""
    context = multiprocessing.get_context("fork")
    left, running = list(reversed(mutants)), dict[BaseProcess, tuple[Mutant, float]]()
    while left or running:
        while left and len(running) < jobs:
            mutant = left.pop()
            if mutant.key in targets.equivalents:
                yield mutant, EQUIVALENT
                continue
            process = context.Process(target=judge, args=(mutant, targets.tests[mutant.file]))
            process.start()
            running[process] = mutant, time.monotonic() + timeout_s
        wait([process.sentinel for process in running], timeout=0.5)
        for process, (mutant, until_s) in tuple(running.items()):
            if process.is_alive() and time.monotonic() < until_s:
                continue
            if process.is_alive():
                process.kill()
                found = TIMED_OUT
            else:
                found = SURVIVED if process.exitcode == 0 else KILLED
            process.join()
            del running[process]
            yield mutant, found


def preload() -> None:
    """Import once what every test needs and no mutant is; each process is forked from this one."""
    for name in ("pytest", "_pytest.assertion.rewrite", "hypothesis", "hypothesis.stateful", "numpy", "cv2",
                 "pydantic", "cantools",
                 "typer.testing", "xdist.plugin", "pytest_timeout", "_hypothesis_pytestplugin"):  # fmt: skip
        importlib.import_module(name)
    hypothesis = importlib.import_module("hypothesis")
    phases = (
        hypothesis.Phase.explicit,
        hypothesis.Phase.generate,
    )  # a failure is enough, the least is not asked
    hypothesis.settings.register_profile(
        PROFILE, phases=phases, deadline=None, derandomize=True, database=None
    )


def report(found: Counter[str], per_file: dict[str, Counter[str]], seed: int) -> str:
    """The score as Markdown."""
    lines = ["| file | mutants | killed | survived |", "| --- | ---: | ---: | ---: |"]
    for file, counts in sorted(per_file.items()):
        killed = counts[KILLED] + counts[TIMED_OUT]
        lines.append(f"| `{file}` | {killed + counts[SURVIVED]} | {killed} | {counts[SURVIVED]} |")
    return "\n".join(["", f"{score(found)}, sampled with seed {seed}.", "", *lines, ""])


def score(found: Counter[str]) -> str:
    """In a sentence."""
    killed = found[KILLED] + found[TIMED_OUT]
    judged = killed + found[SURVIVED]
    share = 100.0 * killed / judged if judged else 0.0
    more = f"; {found[EQUIVALENT]} more change nothing" if found[EQUIVALENT] else ""
    return f"{killed} of {judged} mutants killed ({share:.1f} %){more}"


def write(page: Path, text: str) -> None:
    """Put the score between its marks on a page, at its end where there are none yet."""
    old = page.read_text(encoding="utf-8")
    if BEGIN not in old:
        old = f"{old.rstrip()}\n\n## Mutants of the safety path\n\n{BEGIN}\n{END}\n"
    pattern = re.compile(re.escape(BEGIN) + ".*" + re.escape(END), re.DOTALL)
    page.write_text(pattern.sub(lambda _: f"{BEGIN}{text}{END}", old), encoding="utf-8")


def main() -> None:
    """Parse the words and run."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--sample", type=int, default=200, help="mutants to judge; 0 for all")
    words.add_argument("--seed", type=int, default=1)
    words.add_argument("--only", nargs="+", default=[], help="files whose path contains one of these")
    words.add_argument("--jobs", type=int, default=2)
    words.add_argument("--timeout", type=float, default=120.0, help="s per mutant; one that hangs is noticed")
    words.add_argument("--least", type=float, default=95.0, help="share in percent below which it fails")
    words.add_argument("--write", type=Path, metavar="PAGE", help="put the score into this Markdown page")
    given = words.parse_args()
    os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", PYTHONDONTWRITEBYTECODE="1")
    sys.dont_write_bytecode = True
    targets = Targets.read()
    files = [name for name in targets.tests if not given.only or any(part in name for part in given.only)]
    mutants = [mutant for file in files for mutant in mutants_of(ROOT, file)]
    print(f"{len(mutants)} mutants of {len(files)} files", flush=True)
    if given.sample and given.sample < len(mutants):
        mutants = random.Random(given.seed).sample(mutants, given.sample)
    preload()
    for tests in {tuple(targets.tests[file]) for file in files}:
        untouched = multiprocessing.get_context("fork").Process(target=judge, args=(None, list(tests)))
        untouched.start()
        untouched.join()
        if untouched.exitcode != 0:
            sys.exit(f"the tests fail without any mutant: pytest {' '.join(tests)}")
    found: Counter[str] = Counter()
    per_file: dict[str, Counter[str]] = {}
    survivors: list[Mutant] = []
    for number, (mutant, verdict) in enumerate(run(mutants, targets, given.jobs, given.timeout), 1):
        found[verdict] += 1
        per_file.setdefault(mutant.file, Counter())[verdict] += 1
        if verdict == SURVIVED:
            survivors.append(mutant)
            print(f"\n{mutant}", flush=True)
        elif number % 20 == 0:
            print(f"{number} of {len(mutants)}: {score(found)}", flush=True)
    print(f"\n{score(found)}")
    if given.write is not None:
        write(given.write, report(found, per_file, given.seed))
    killed = found[KILLED] + found[TIMED_OUT]
    sys.exit(100.0 * killed < given.least * (killed + len(survivors)))


if __name__ == "__main__":
    main()
