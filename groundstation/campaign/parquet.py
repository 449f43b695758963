"""The rows as a Parquet table, where pyarrow is installed (extra ``cluster``)."""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from groundstation.campaign.errors import CampaignError
from groundstation.campaign.flying import Row

NAME = "runs.parquet"
WHOLE, TEXTS = ("run", "seed"), ("verdict", "reason")


def write_parquet(folder: Path, columns: Sequence[str], rows: Sequence[Row]) -> None:
    """Write the rows: numbers as numbers, what is unknown as null; does nothing without pyarrow.

    Raises:
        CampaignError: The disk is full, or gone.
    """
    if find_spec("pyarrow") is None:
        return
    import pyarrow
    from pyarrow import parquet

    table = pyarrow.table({name: _column(name, [row[name] for row in rows]) for name in columns})
    part = folder / f"{NAME}.part"
    try:
        parquet.write_table(table, part)
        part.replace(folder / NAME)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise CampaignError(
            f"{folder / NAME} cannot be written; all rows are in runs.csv ({error})"
        ) from error


def _column(name: str, cells: list[str]) -> list[int] | list[str] | list[float | None]:
    if name in WHOLE:
        return [int(cell) for cell in cells]
    if name in TEXTS:
        return cells
    try:
        return [float(cell) if cell else None for cell in cells]
    except ValueError:  # a choice of texts
        return cells
