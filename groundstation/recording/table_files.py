"""Topics of a recording as CSV or Parquet files, one per topic."""

import csv
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.errors import UsageError
from groundstation.recording.opened import OpenedRecording
from groundstation.recording.topic_table import TopicTable

Progress = Callable[[str, float], None]
_ROWS = 10_000
"""Written at a time."""


def check_parquet() -> None:
    """Refuse before any work is done.

    Raises:
        UsageError: pyarrow is not installed.
    """
    if find_spec("pyarrow") is None:
        raise UsageError("Parquet files need pyarrow: pip install 'groundstation[cluster]'.")


def file_stem(topic: str) -> str:
    """Name of a topic's file, without its ending: ``alpha_state`` of ``alpha/state``."""
    return topic.replace("/", "_")


def write_csv(table: TopicTable, path: Path) -> list[str]:
    """Write a topic as CSV: a header with units, a row per message, vectors in columns of their own.

    Texts are as they are; sequences of numbers are parted by spaces.

    Returns:
        Columns that are not in it: bytes have no place in a CSV file.
    """
    columns = _with_seconds(table)
    left_out = [name for name, values in columns.items() if _holds_bytes(values)]
    kept = {name: values for name, values in columns.items() if name not in left_out}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(kept)
        for begin in range(0, len(table), _ROWS):
            cells = [_words(values[begin : begin + _ROWS]) for values in kept.values()]
            writer.writerows(zip(*cells, strict=True))
    return left_out


def write_parquet(table: TopicTable, path: Path) -> list[str]:
    """Write a topic as Parquet: the columns of the CSV file, sequences as lists and bytes as they are.

    Returns:
        Columns that are not in it: none.
    """
    import pyarrow
    from pyarrow import parquet

    columns = {
        name: pyarrow.array(
            [_plain(value) for value in values] if values.dtype.kind == "O" else values.tolist()
        )
        if values.dtype.kind in "OU"
        else pyarrow.array(np.ascontiguousarray(values))
        for name, values in _with_seconds(table).items()
    }
    parquet.write_table(pyarrow.table(columns), path)
    return []


def write_tables(
    recording: OpenedRecording,
    topics: list[str],
    folder: Path,
    write: Callable[[TopicTable, Path], list[str]],
    ending: str,
    progress: Progress,
) -> Iterator[tuple[Path, TopicTable, list[str]]]:
    """Write topics into a folder.

    Args:
        recording: Open.
        topics: Names.
        folder: That is there.
        write: ``write_csv`` or ``write_parquet``.
        ending: Of the files.
        progress: Takes what is being done, and the share that is done.

    Yields:
        Each file with its table, and the columns that were left out.
    """
    for done, topic in enumerate(topics):
        progress(topic, done / len(topics))
        table = recording[topic]
        path = folder / f"{file_stem(topic)}.{ending}"
        yield path, table, write(table, path)
        recording.forget(topic)
    progress("done", 1.0)


def _with_seconds(table: TopicTable) -> dict[str, NDArray[Any]]:
    return {"stamp_s": table.stamp_s, **table.flat()}


def _holds_bytes(values: NDArray[Any]) -> bool:
    return values.dtype.kind == "O" and any(isinstance(value, bytes) for value in values)


def _words(values: NDArray[Any]) -> list[Any]:
    if values.dtype.kind == "O":
        return [" ".join(map(str, _plain(value))) for value in values]
    if values.dtype == np.float32:
        return [str(value) for value in values]  # the shortest that means the same, not its float64
    found: list[Any] = values.tolist()
    return found


def _plain(value: Any) -> Any:  # noqa: ANN401 a sequence of any kind
    return value.tolist() if isinstance(value, np.ndarray) else value
