"""The numbers of a recording: those that the parts declare (``Figure``), and the ledger's own latency."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from groundstation.bus.envelope import Delivered
from groundstation.declarations.message import Message
from groundstation.declarations.tables import Tables
from groundstation.declarations.view import Figure
from groundstation.parts.operation.messages import Latency
from groundstation.watch.tracks import DRAWN, Track, TrackBuilder


class VehicleReport(NamedTuple):
    """What a recording states of one vehicle: arrays for figures, and numbers for ``report.json``."""

    track: Track
    numbers: dict[str, Any]


def wanted(tables: Tables) -> list[type[Message]]:
    """Classes that a report is made from."""
    figures = (make() for part in tables.parts.values() for make in part.figures)
    return list(dict.fromkeys([*DRAWN, *(kind for figure in figures for kind in figure.inputs)]))


def summarise(tables: Tables, messages: Iterable[Delivered], start_ns: int) -> dict[str, VehicleReport]:
    """Read messages into reports, by vehicle.

    Args:
        tables: Of the parts whose figures are wanted.
        messages: Of the classes that ``wanted`` names, in the order of a recording.
        start_ns: When the recording began.

    Returns:
        The vehicles of which there is a state.
    """
    collectors: dict[str, _Collector] = {}
    for _, payload in messages:
        name = payload.vehicle
        if name:
            collector = collectors.get(name)
            if collector is None:
                collector = collectors[name] = _Collector(tables)
            collector.take(payload, (payload.stamp_ns - start_ns) * 1e-9)
    reports = {name: collector.report() for name, collector in collectors.items()}
    return {name: report for name, report in reports.items() if len(report.track.state)}


class _Collector:
    """Makes the report of one vehicle."""

    def __init__(self, tables: Tables) -> None:
        self._track = TrackBuilder()
        self._figures: list[Figure] = [make() for part in tables.parts.values() for make in part.figures]
        self._takers: dict[type[Message], list[Callable[[Message, float], None]]] = {}
        for kind in DRAWN:
            self._takers.setdefault(kind, []).append(self._track.take)
        for figure in self._figures:
            for kind in figure.inputs:
                self._takers.setdefault(kind, []).append(figure.take)

    def take(self, payload: Message, t_s: float) -> None:
        for take in self._takers.get(type(payload), ()):
            take(payload, t_s)

    def report(self) -> VehicleReport:
        track = self._track.track()
        numbers = {key: value for figure in self._figures for key, value in figure.values().items()}
        latency = track.latency
        numbers["latency_p50_ms"] = {} if latency is None else _stages(latency, latency.p50_s)
        numbers["latency_p99_ms"] = {} if latency is None else _stages(latency, latency.p99_s)
        return VehicleReport(track, numbers)


def _stages(latency: Latency, ages_s: tuple[float, ...]) -> dict[str, float]:
    return {stage: age * 1e3 for stage, age in zip(latency.stages, ages_s, strict=True)}
