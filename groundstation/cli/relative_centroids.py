"""`groundstation relative centroids`: the centres of the tips in every frame of a file."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import cv2
import typer

from groundstation.cli.progress import with_progress
from groundstation.data_sets.relative_frames import read_frames
from groundstation.declarations.errors import UsageError
from groundstation.files.number_tables import csv_text
from groundstation.files.writing import check_targets, write_files
from groundstation.relative_navigation.centres import DEFAULT, METHODS
from groundstation.relative_navigation.spots import SpotFinder, SpotSettings, SpotsSeen, Trouble

COLUMNS = ("frame", "u", "v")


def centroids(
    frames: Annotated[
        Path, typer.Argument(help="FRAMES.npz with an array `frames` (n, rows, columns), 8 bit.")
    ],
    out: Annotated[Path, typer.Option(help="CSV to write: frame,u,v, a row for every tip.")],
    method: Annotated[str, typer.Option(help=f"Of centres, one of: {', '.join(METHODS)}.")] = DEFAULT,
    level: Annotated[
        float | None,
        typer.Option(help="Published threshold, 0 darkest to 1 brightest; without it, from the noise."),
    ] = None,
    sigma: Annotated[
        Path | None,
        typer.Option(help="CSV to write as well: frame,u,v and the covariance of each centre, px^2."),
    ] = None,
) -> None:
    """Find the centre of every tip to a fraction of a pixel; (0, 0) is the centre of the top-left pixel.

    Example: groundstation relative centroids frames.npz --out centroids.csv

    Example: groundstation relative centroids frames.npz --out centroids.csv --method contour
    """
    if method not in METHODS:
        raise UsageError(f"--method must be one of {', '.join(METHODS)}, found {method!r}.")
    if level is not None and not 0.0 < level <= 1.0:
        raise UsageError(f"--level must be above 0 and at most 1, found {level:g}.")
    check_targets(out, sigma, sources=[frames])
    cv2.setNumThreads(1)
    pictures = read_frames(frames)
    finder = SpotFinder(SpotSettings(method=method, level=level))
    seen: list[SpotsSeen] = [finder.look(picture) for picture in with_progress(list(pictures), "looking")]
    rows = [
        (str(number), f"{u:.5f}", f"{v:.5f}")
        for number, each in enumerate(seen)
        for u, v in each.centres.pixels.tolist()
    ]
    contents = {out: csv_text(COLUMNS, rows)}
    if sigma is not None:
        contents[sigma] = csv_text(
            (*COLUMNS, "var_u_px2", "cov_uv_px2", "var_v_px2"),
            [
                (str(number), f"{u:.5f}", f"{v:.5f}", f"{c[0, 0]:.3e}", f"{c[0, 1]:.3e}", f"{c[1, 1]:.3e}")
                for number, each in enumerate(seen)
                for (u, v), c in zip(each.centres.pixels.tolist(), each.centres.covariances, strict=True)
            ],
        )
    write_files(contents)
    print(f"{len(seen)} frames, {len(rows)} centres.")
    for trouble, count in sorted(Counter(each.trouble for each in seen).items()):
        if trouble is not Trouble.NONE:
            print(f"  {trouble.value}: {count}")
