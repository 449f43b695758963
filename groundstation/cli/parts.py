"""``groundstation parts``: the whole system on one screen."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from groundstation.declarations.errors import RigError
from groundstation.files.errors import FileError
from groundstation.rig.overview import HEADINGS, as_markdown, overview
from groundstation.rig.read import load_rig

app = typer.Typer(rich_markup_mode=None)

_WIDTH = 150  # on a pipe too: names are never cut


@app.command()
def parts(
    rig: Annotated[Path | None, typer.Argument(help="Rig file; without it all that parts declare.")] = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="As a page of the documentation.")] = False,
) -> None:
    """Print every topic: who publishes it, who receives it, at what rate, in which process.

    Example: groundstation parts examples/rigs/overhead.toml
    """
    try:
        view = overview(None if rig is None else load_rig(rig))
    except FileError:
        raise
    except ValueError as error:  # a node refuses its configuration
        raise RigError(f"{rig}: {error}") from error
    if markdown:
        print(as_markdown(view), end="")
        return
    console = Console()
    console.width = max(console.width, _WIDTH)
    for part in view.parts:
        print(f"{part.name}: {part.summary}")
    table = Table(*HEADINGS, box=None, pad_edge=False)
    for row in view.rows:
        table.add_row(*row.cells())
    console.print(table)
