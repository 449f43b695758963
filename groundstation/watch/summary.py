"""The numbers of a recording: those that the parts declare (``Figure``), and the ledger's own latency."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from groundstation.bus.cdr_columns import Columns, columns_of
from groundstation.bus.envelope import Delivered
from groundstation.declarations.message import Message
from groundstation.declarations.tables import Tables
from groundstation.declarations.view import Figure
from groundstation.parts.operation.messages import Latency
from groundstation.recording.columns import Key, read_columns
from groundstation.recording.reader import Recording
from groundstation.watch.tracks import DRAWN, DRAWN_COLUMNS, Track, TrackBuilder


class VehicleReport(NamedTuple):
    """What a recording states of one vehicle: arrays for pictures, and numbers for ``report.json``."""

    track: Track
    numbers: dict[str, Any]


class Listener(Protocol):
    """Takes every message that is read one by one, those of the whole rig included."""

    def take(self, message: Message, t_s: float) -> None:
        """Account for a message; times count from the start of the recording."""


def wanted(tables: Tables) -> list[type[Message]]:
    """Classes of which a report is made message by message."""
    return list(dict.fromkeys([*DRAWN, *(kind for figure in _figures(tables) for kind in figure.inputs)]))


def wanted_columns(tables: Tables) -> dict[type[Message], list[str]]:
    """Classes that come too often for that, and the fields that are read of them."""
    found: dict[type[Message], list[str]] = defaultdict(list)
    for columns in (DRAWN_COLUMNS, *(figure.columns for figure in _figures(tables))):
        for kind, names in columns.items():
            found[kind] += [name for name in names if name not in found[kind]]
    return found


def read_reports(
    tables: Tables,
    recording: Recording,
    listened: Iterable[type[Message]] = (),
    listener: Listener | None = None,
) -> dict[str, VehicleReport]:
    """Read a recording into reports, by vehicle.

    Args:
        tables: Of the parts whose figures are wanted.
        recording: The file.
        listened: Classes that the listener wants.
        listener: Takes messages besides.

    Returns:
        The vehicles of which there is a state.

    Raises:
        RecordingError: A chunk or a payload of the file is damaged.
    """
    columns = read_columns(recording, wanted_columns(tables))
    kinds = dict.fromkeys([*wanted(tables), *listened])
    return _summarise(tables, recording.delivered(kinds), columns, recording.start_ns, listener)


def summarise(tables: Tables, messages: Iterable[Delivered], start_ns: int) -> dict[str, VehicleReport]:
    """The same of messages in memory: of any classes, in the order of a recording."""
    names = wanted_columns(tables)
    kept: dict[Key, list[Message]] = defaultdict(list)
    others: list[Delivered] = []
    for one in messages:
        kind = type(one.payload)
        if kind in names:
            kept[kind, one.payload.vehicle].append(one.payload)
        others.append(one)
    columns = {(kind, owner): columns_of(rows, names[kind]) for (kind, owner), rows in kept.items()}
    return _summarise(tables, others, columns, start_ns, None)


def _summarise(
    tables: Tables,
    messages: Iterable[Delivered],
    columns: Mapping[Key, Columns],
    start_ns: int,
    listener: Listener | None,
) -> dict[str, VehicleReport]:
    collectors: dict[str, _Collector] = {}

    def of(name: str) -> "_Collector":
        found = collectors.get(name)
        if found is None:
            found = collectors[name] = _Collector(tables)
        return found

    for _, payload in messages:
        t_s = (payload.stamp_ns - start_ns) * 1e-9
        if payload.vehicle:
            of(payload.vehicle).take(payload, t_s)
        if listener is not None:
            listener.take(payload, t_s)
    for (kind, name), rows in columns.items():
        if name:
            of(name).take_columns(kind, rows, start_ns)
    reports = {name: collector.report() for name, collector in sorted(collectors.items())}
    return {name: report for name, report in reports.items() if len(report.track.state)}


def _figures(tables: Tables) -> Iterator[Figure]:
    return (make() for part in tables.parts.values() for make in part.figures)


class _Collector:
    """Makes the report of one vehicle."""

    def __init__(self, tables: Tables) -> None:
        self._track = TrackBuilder()
        self._figures = list(_figures(tables))
        self._takers: dict[type[Message], list[Callable[[Message, float], None]]] = defaultdict(list)
        for kind in DRAWN:
            self._takers[kind].append(self._track.take)
        for figure in self._figures:
            for kind in figure.inputs:
                self._takers[kind].append(figure.take)

    def take(self, payload: Message, t_s: float) -> None:
        for take in self._takers.get(type(payload), ()):
            take(payload, t_s)

    def take_columns(self, kind: type[Message], rows: Columns, start_ns: int) -> None:
        order = np.argsort(rows.stamp_ns, kind="stable")  # what came late is counted where it belongs
        t_s = ((rows.stamp_ns[order] - start_ns) * 1e-9).astype(np.float64)
        takers = [(self._track.take_columns, DRAWN_COLUMNS)]
        takers += [(figure.take_columns, figure.columns) for figure in self._figures]
        for take, columns in takers:
            if kind in columns:
                take(kind, t_s, {name: rows[name][order] for name in columns[kind]})

    def report(self) -> VehicleReport:
        track = self._track.track()
        numbers = {key: value for figure in self._figures for key, value in figure.values().items()}
        latency = track.latency
        numbers["latency_p50_ms"] = {} if latency is None else _stages(latency, latency.p50_s)
        numbers["latency_p99_ms"] = {} if latency is None else _stages(latency, latency.p99_s)
        return VehicleReport(track, numbers)


def _stages(latency: Latency, ages_s: tuple[float, ...]) -> dict[str, float]:
    return {stage: age * 1e3 for stage, age in zip(latency.stages, ages_s, strict=True)}
