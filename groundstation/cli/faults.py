"""``groundstation faults``: modes, transitions, the arming gate and faults on one screen."""

from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from groundstation.supervision.overview import as_markdown, tables

app = typer.Typer(rich_markup_mode=None)

_WIDTH = 150  # on a pipe too


@app.command()
def faults(
    markdown: Annotated[bool, typer.Option("--markdown", help="As a page of the documentation.")] = False,
) -> None:
    """Print what a supervisor guarantees, what moves it, and what it does about each fault.

    Example: groundstation faults
    """
    if markdown:
        print(as_markdown(tables()), end="")
        return
    console = Console()
    console.width = max(console.width, _WIDTH)
    for shown in tables():
        table = Table(box=None, pad_edge=False)
        for column, heading in enumerate(shown.headings):
            table.add_column(heading, no_wrap=column == 0)  # names are never cut
        for row in shown.rows:
            table.add_row(*row)
        print(f"\n{shown.title}\n{shown.text}\n")
        console.print(table)
