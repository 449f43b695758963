"""One topic of a recording as a table: a row per message, a column per field."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.cdr_columns import Columns
from groundstation.bus.cdr_fields import Numbers, Run, Texts, parts, ros_fields
from groundstation.declarations.errors import UsageError
from groundstation.declarations.message import Message
from groundstation.recording.columns import read_columns, read_heads
from groundstation.recording.errors import UnknownFieldError
from groundstation.recording.reader import Recording

Ints = NDArray[np.int64]


class TopicTable:
    """The messages of one topic, in the order of their log times.

    Columns carry their units in their names: ``table["heading_rad"]`` or ``table.heading_rad``. Vectors are
    arrays of shape (n, k), texts arrays of ``str``; sequences whose length differs from message to message
    are arrays of objects, each a tuple, an array or bytes.

    Attributes:
        name: Of the topic, such as ``alpha/state``.
        type: Its ROS 2 type.
        columns: Names of the fields.
        stamp_ns: The moment that each message is about, monotonic clock of the host; shape (n,), int64.
        stamp_s: The same in seconds since the recording began; shape (n,), float64.
        log_ns: Log time of each; shape (n,), int64.
        sequence: Number of each publication; shape (n,), int64.
    """

    def __init__(self, recording: Recording, name: str, kind: type[Message], owner: str) -> None:
        self.name = name
        self.type = kind.ROS_TYPE
        self.columns = tuple(field for field, _ in ros_fields(kind))
        self._recording, self._kind, self._owner = recording, kind, owner
        quick, self._slow = _split(kind)
        heads = read_heads(recording, kind, owner)
        found = read_columns(recording, {kind: quick}, [owner])[kind, owner]
        self._order = np.argsort(heads.log_ns, kind="stable")
        self.log_ns: Ints = heads.log_ns[self._order]
        self.sequence: Ints = heads.sequence[self._order]
        self.stamp_ns: Ints = found.stamp_ns[self._order]
        self.stamp_s: NDArray[np.float64] = np.asarray(
            (self.stamp_ns - recording.start_ns) * 1e-9, np.float64
        )
        self._found = {column: _plain(found, column)[self._order] for column in quick}

    def __getitem__(self, column: str) -> NDArray[Any]:
        """A column.

        Raises:
            UnknownFieldError: There is none of that name.
        """
        if column in ("stamp_s", "stamp_ns", "log_ns", "sequence"):
            found: NDArray[Any] = getattr(self, column)
            return found
        if column in self._found:
            return self._found[column]
        if column not in self.columns:
            raise UnknownFieldError(
                f"{self.name} has no field {column!r}: there are {', '.join(self.columns)}"
            )
        for name, values in self._read_slowly().items():
            self._found[name] = values
        return self._found[column]

    def __getattr__(self, column: str) -> NDArray[Any]:
        if column.startswith("_"):
            raise AttributeError(column)
        try:
            return self[column]
        except UnknownFieldError as error:
            raise AttributeError(str(error)) from error

    def __len__(self) -> int:
        return len(self.stamp_ns)

    def __contains__(self, column: object) -> bool:
        return column in self.columns

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.columns]

    def __repr__(self) -> str:
        return f"<{self.name}: {len(self)} messages of {', '.join(self.columns)}>"

    def flat(self) -> dict[str, NDArray[Any]]:
        """Every column as one or several of shape (n,): ``position_table_m[0]``, ``position_table_m[1]``."""
        out: dict[str, NDArray[Any]] = {"stamp_ns": self.stamp_ns}
        for column in self.columns:
            values = self[column]
            if values.ndim == 1:
                out[column] = values
            else:
                out |= {f"{column}[{place}]": values[:, place] for place in range(values.shape[1])}
        return out

    def dataframe(self) -> Any:  # noqa: ANN401 pandas is an extra
        """The table as a pandas DataFrame: rows by ``stamp_s``, a column for each part of a vector.

        Raises:
            UsageError: pandas is not installed.
        """
        try:
            import pandas
        except ImportError as error:
            raise UsageError("DataFrames need pandas: pip install 'groundstation[notebook]'.") from error
        return pandas.DataFrame(self.flat(), index=pandas.Index(self.stamp_s, name="stamp_s"))

    def _read_slowly(self) -> dict[str, NDArray[Any]]:
        """Fields that lie at another place in each message, decoded one by one; in log order."""
        rows: dict[str, list[Any]] = {name: [] for name in self._slow}
        for message in self._recording.messages([self._kind], [self._owner]):
            payload = message.payload
            for name, values in rows.items():
                values.append(getattr(payload, name))
        return {name: _array(values) for name, values in rows.items()}


def _split(kind: type[Message]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Fields that are read many at once, and those that are not."""
    quick: list[str] = []
    slow: list[str] = []
    is_reachable = True
    for part in parts(kind):
        if isinstance(part, Texts):
            is_reachable = False
        names = part.names if isinstance(part, Run) else (part.name,)
        (quick if is_reachable and not isinstance(part, Numbers) else slow).extend(names)
    return tuple(quick), tuple(slow)


def _plain(found: Columns, column: str) -> NDArray[Any]:
    values = found[column]
    return np.char.decode(values, "utf-8", "replace") if values.dtype.kind == "S" else values


def _array(values: list[Any]) -> NDArray[Any]:
    """Of numbers, texts or vectors of one length an array, of anything else one of objects."""
    if all(isinstance(value, str | bool | int | float) for value in values):
        return np.array(values)
    if not isinstance(values[0], bytes) and len({len(value) for value in values}) == 1:
        stacked = np.array(values)
        if stacked.ndim == 2 and stacked.dtype.kind in "biuf":
            return stacked
    out = np.empty(len(values), object)
    for place, value in enumerate(values):
        out[place] = value
    return out
