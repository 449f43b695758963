"""``groundstation parts``: the whole system on one screen."""

from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from groundstation.bridges.ros2_package import write_package
from groundstation.declarations.errors import RigError
from groundstation.files.errors import FileError
from groundstation.parts.table import installed_tables
from groundstation.rig.overview import HEADINGS, as_markdown, overview
from groundstation.rig.read import load_rig

app = typer.Typer(rich_markup_mode=None)

_WIDTH = 150  # on a pipe too: names are never cut


@app.command()
def parts(
    rig: Annotated[Path | None, typer.Argument(help="Rig file; without it all that parts declare.")] = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="As a page of the documentation.")] = False,
    ros2_package: Annotated[
        Path | None, typer.Option(help="Write the messages as a ROS 2 package into this folder instead.")
    ] = None,
) -> None:
    """Print every topic: who publishes it, who receives it, at what rate, in which process.

    Example: groundstation parts examples/rigs/overhead.toml

    Example: groundstation parts --ros2-package ros2_ws/src
    """
    if ros2_package is not None:
        payloads = installed_tables().payloads.values()
        print(write_package(ros2_package, payloads, version("groundstation")))
        return
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
