"""The command line of the live laboratory: read a rig, serve it, end cleanly."""

import argparse
import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from pydantic import ValidationError

from drivers.errors import NotFound
from drivers.files.errors import FileError
from drivers.files.reading import read_bytes
from drivers.files.trees import parse_toml
from firmware_emulator.live.server import LiveLaboratory

_DESCRIPTION = (
    "Emulate the laboratory of a rig in real time. Prints one JSON line that says where each channel can be "
    "opened, then serves until SIGTERM, SIGINT or, if stdin is a pipe, its end."
)
_ENDING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


class _Ended(BaseException):
    """A signal came before there was a laboratory to stop."""


class _BadRig(Exception):  # noqa: N818 - the sentence is all that matters
    """The rig file cannot be used; the message gives the reason in one sentence."""


def read_laboratory(path: Path, descriptor: int | None = None) -> dict[str, object]:
    """The `[laboratory]` table of a rig file, with `folder` set to where the file lies.

    Args:
        path: Of the rig.
        descriptor: Open file that holds its text instead: a scenario changes the rig that it flies.
    """
    if descriptor is None:
        data = read_bytes(path)
    else:
        with os.fdopen(descriptor, "rb") as content:
            data = content.read()
    rig = parse_toml(data, path)
    table = rig.get("laboratory")
    if not isinstance(table, Mapping):
        raise _BadRig(f"{path}: has no table [laboratory]")
    return {"folder": str(path.resolve().parent), **table}


def sentence(error: ValidationError) -> str:
    """The first complaint of a validation as one sentence that names the key."""
    first = error.errors()[0]
    key = ".".join(["laboratory", *map(str, first["loc"])])
    found = "" if first.get("ctx") else f", got {first['input']!r}"
    return f"{key}: {first['msg'].removeprefix('Value error, ')}{found}"


def _seed(text: str) -> int:
    seed = int(text)
    if seed < 0:
        raise ValueError(f"seed {seed} is negative")
    return seed


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve the laboratory of a rig file; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m firmware_emulator", description=_DESCRIPTION)
    parser.add_argument("rig", type=Path, help="rig file (TOML) with a table [laboratory]")
    parser.add_argument("--seed", type=_seed, default=0, help="decides every random number (default 0)")
    parser.add_argument(
        "--text-from", type=int, help="open file (its number) that holds the rig's text instead"
    )
    options = parser.parse_args(arguments)
    with _signals(_end):
        try:
            laboratory = LiveLaboratory(read_laboratory(options.rig, options.text_from), options.seed)
        except ValidationError as error:
            return _refuse(f"{options.rig}: {sentence(error)}")
        except (_BadRig, FileError, NotFound) as error:
            return _refuse(str(error))
        except OSError as error:
            return _refuse(f"{options.rig}: its text cannot be read ({error.strerror}).")
        except _Ended:
            return 0
        try:
            with _signals(lambda *_: laboratory.stop()):
                laboratory.watch_parent()
                sys.stdout.write(laboratory.announcement())
                sys.stdout.flush()
                laboratory.run()
        except (_Ended, BrokenPipeError):  # nobody listens to the announcement any more
            return 0
        finally:
            laboratory.close()
    return 0


@contextmanager
def _signals(handler: Callable[..., None]) -> Iterator[None]:
    """Let a handler have the signals that end us, for a while."""
    before = {number: signal.signal(number, handler) for number in _ENDING}
    try:
        yield
    finally:
        for number, previous in before.items():
            signal.signal(number, previous)


def _end(*_: object) -> None:
    raise _Ended


def _refuse(complaint: str) -> int:
    sys.stderr.write(" ".join(complaint.split()) + "\n")
    return 2
