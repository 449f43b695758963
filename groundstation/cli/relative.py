"""`groundstation relative`: where another craft is and how it turns, from pictures of known points."""

import typer

from groundstation.cli.relative_centroids import centroids
from groundstation.cli.relative_spin import spin
from groundstation.cli.relative_target import target
from groundstation.cli.relative_tle import tle
from groundstation.cli.relative_track import track

app = typer.Typer(no_args_is_help=True, add_completion=False, rich_markup_mode=None)


@app.callback()
def _root() -> None:
    """Poses and rates of another craft from the pictures of a camera.

    Example: groundstation relative track case.json --pixels pixels.csv --out poses.csv
    """


app.command()(track)
app.command()(centroids)
app.command()(spin)
app.command()(target)
app.command()(tle)
