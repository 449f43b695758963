"""The table's map as a file: one row per grid point, x fastest."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from groundstation.cli.errors import UsageError
from groundstation.cli.fusion_folder import read_table
from groundstation.fusion.table_map import TableMap

COLUMNS = ("x_m", "y_m", "pull_x_m_s2", "pull_y_m_s2", "std_m_s2")


def map_lines(table_map: TableMap) -> Iterator[str]:
    """Yield the lines of a map's file."""
    yield ",".join(COLUMNS) + "\n"
    rows, columns = table_map.pull_x_m_s2.shape
    for j in range(rows):
        for i in range(columns):
            yield (
                f"{table_map.x0_m + i * table_map.step_m:.4f},{table_map.y0_m + j * table_map.step_m:.4f},"
                f"{table_map.pull_x_m_s2[j, i]:.8f},{table_map.pull_y_m_s2[j, i]:.8f},"
                f"{table_map.std_m_s2[j, i]:.8f}\n"
            )


def read_map(path: Path) -> TableMap:
    """Read a map.

    Raises:
        UsageError: the file is missing, or its points are no regular grid.
    """
    table = read_table(path, COLUMNS)
    x, y = np.unique(table[:, 0]), np.unique(table[:, 1])
    step = float(np.median(np.diff(x))) if len(x) > 1 else 0.0
    regular = (
        len(x) > 1
        and len(y) > 1
        and len(table) == len(x) * len(y)
        and np.allclose(np.diff(x), step, atol=2e-4)
        and np.allclose(np.diff(y), step, atol=2e-4)
    )
    if not (regular and np.isfinite(table).all() and (table[:, 4] > 0.0).all()):
        raise UsageError(f"{path} is not a regular grid of finite pulls with sigmas above zero.")
    order = np.lexsort((table[:, 0], table[:, 1]))
    fields = table[order].T.reshape(5, len(y), len(x))
    return TableMap(float(x[0]), float(y[0]), step, fields[2], fields[3], fields[4])
