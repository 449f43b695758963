"""``groundstation demo``: small data sets of every kind, to try commands on without a laboratory."""

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from drivers.laboratory.demo_data import demo_kinds
from groundstation.cli.number_options import LAST_SEED
from groundstation.cli.progress import with_progress
from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError
from groundstation.files.writing import check_folder, whole_folder

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None)


@app.callback()
def demo() -> None:
    """Small data sets of every kind, made by the emulator."""


@app.command()
def data(
    folder: Annotated[Path, typer.Argument(help="Where the folders go; made if it is not there.")],
    only: Annotated[list[str] | None, typer.Option(help="Of this kind; may be repeated.")] = None,
    seed: Annotated[
        int, typer.Option(help="Decides places, noise and all the rest.", min=0, max=LAST_SEED)
    ] = 1,
) -> None:
    """Make small folders of every kind that commands take, and print what can be tried on each.

    Example: groundstation demo data try
    """
    kinds = {kind.name: kind for kind in demo_kinds()}
    for name in only or ():
        if name not in kinds:
            raise UsageError(f"--only is {name!r}, expected one of {', '.join(kinds)}")
    wanted = [kinds[name] for name in only or kinds]
    check_folder(folder)
    for kind in wanted:
        check_folder(folder / kind.name)
        if (folder / kind.name).exists():
            raise UsageError(f"{folder / kind.name} is already there: name another folder")
    folder.mkdir(parents=True, exist_ok=True)
    for kind in with_progress(wanted, "making"):
        try:
            with whole_folder(folder / kind.name) as made:
                kind.make(made, seed)
        except FileError:
            with suppress(OSError):  # it stays where it holds something
                folder.rmdir()
            raise
    for kind in wanted:
        print(f"{kind.name}: {kind.summary}")
        for words in kind.commands:
            print(f"  groundstation {words.format(here=folder / kind.name)}")
