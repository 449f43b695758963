"""Any fields of a recording against time, those of one unit on one axis."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.errors import UsageError
from groundstation.files.png import new_figure
from groundstation.recording.opened import OpenedRecording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
_UNITS = {
    "s": "s", "ns": "ns", "ms": "ms", "us": "µs", "m": "m", "mm": "mm", "m_s": "m/s", "m_s2": "m/s²",
    "rad": "rad", "rad_s": "rad/s", "rad_s2": "rad/s²", "deg": "deg", "kg": "kg", "n": "N", "nm": "N m",
    "pa": "Pa", "k": "K",
    "c": "°C", "px": "px", "hz": "Hz", "v": "V", "dn": "DN", "px2": "px²", "bytes": "bytes",
}  # fmt: skip
_MOST_POINTS = 4000
"""Of a curve: more than a picture has columns, drawn by the least and the largest of each piece."""
_MARKED = 400
"""A curve of fewer points shows each."""


class Curve(NamedTuple):
    """One field: its name, times (s since the recording began) and values, shape (n,) each."""

    name: str
    t_s: Array
    values: Array


def curves_of(
    recording: OpenedRecording, fields: Sequence[str], span_s: tuple[float, float | None] = (0.0, None)
) -> list[Curve]:
    """Read fields such as ``alpha/state.position_table_m[0]``.

    A vector without a place in brackets gives a curve for each of its parts.

    Args:
        recording: Open.
        fields: Their names.
        span_s: From and to, in seconds since the recording began; None for the end.

    Raises:
        RecordingError: There is no such topic or field.
        UsageError: Nothing of a field lies in the span.
    """
    found = []
    for name in (part for field in fields for part in _parts(recording, field)):
        t_s, values = recording.field(name)
        chosen = t_s >= span_s[0]
        if span_s[1] is not None:
            chosen &= t_s <= span_s[1]
        if not chosen.any():
            end = recording.duration_s if span_s[1] is None else span_s[1]
            raise UsageError(f"{recording.path}: nothing of {name} lies between {span_s[0]:g} and {end:g} s")
        order = np.argsort(t_s[chosen], kind="stable")
        found.append(Curve(name, t_s[chosen][order], values[chosen][order]))
    return found


def draw_curves(curves: Sequence[Curve], title: str) -> Figure:
    """Draw them, one axis for each unit."""
    by_unit: dict[str, list[Curve]] = {}
    for curve in curves:
        by_unit.setdefault(unit_of(curve.name), []).append(curve)
    figure = new_figure(11.0, 1.0 + 2.8 * len(by_unit))
    places = np.atleast_1d(figure.subplots(len(by_unit), 1, sharex=True))
    for place, (unit, rows) in zip(places, by_unit.items(), strict=True):
        for curve in rows:
            t_s, values = thinned(curve.t_s, curve.values)
            place.plot(t_s, values, ".-" if len(t_s) < _MARKED else "-", linewidth=1.0, label=curve.name)
        place.set_ylabel(unit or "1")
        place.grid(visible=True, alpha=0.3)
        place.legend(loc="best", fontsize=8)
    places[0].set_title(title, fontsize=10)
    places[-1].set_xlabel("time since the recording began, s")
    return figure


def unit_of(name: str) -> str:
    """The unit that the end of a field's name states; empty where it states none."""
    words = re.sub(r"\[\d+\]$", "", name).rpartition(".")[2].split("_")
    for count in (2, 1):
        unit = _UNITS.get("_".join(words[-count:])) if len(words) > count else None
        if unit is not None:
            return unit
    return ""


def thinned(t_s: Array, values: Array) -> tuple[Array, Array]:
    """At most ``_MOST_POINTS``: of each piece the least and the largest value, so that no spike is lost."""
    if len(t_s) <= _MOST_POINTS:
        return t_s, values
    edges = np.linspace(0, len(t_s), _MOST_POINTS // 2 + 1).astype(int)
    chosen: list[int] = []
    for low, high in pairwise(edges.tolist()):
        piece = values[low:high]
        known = np.flatnonzero(~np.isnan(piece))
        if not len(known):
            chosen.append(low)
            continue
        ends = {int(known[np.argmin(piece[known])]), int(known[np.argmax(piece[known])])}
        chosen += sorted(low + end for end in ends)
    return t_s[chosen], values[chosen]


def _parts(recording: OpenedRecording, field: str) -> list[str]:
    """A number's own name, or those of the parts of a vector."""
    topic, dot, column = field.rpartition(".")
    if dot and topic in recording and column in recording[topic]:
        values = recording[topic][column]
        if values.ndim == 2 and values.dtype.kind in "biuf":
            return [f"{field}[{place}]" for place in range(values.shape[1])]
    return [field]
