"""The option ``--plot``: the same for every command that can draw what it found."""

from pathlib import Path
from typing import Annotated

import typer

Plot = Annotated[Path | None, typer.Option("--plot", help="PNG to draw as well.")]
