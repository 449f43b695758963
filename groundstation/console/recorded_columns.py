"""Whole columns of a recording: fields for charts, and tracks of vehicles to be laid over another one."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from groundstation.bus.fields import Field
from groundstation.console.chart_tap import Samples
from groundstation.declarations.message import Message
from groundstation.parts.fusion.messages import VehicleState
from groundstation.recording.columns import read_columns
from groundstation.recording.reader import Recording

MOST_SAMPLES = 20_000
"""Of a field over the whole recording."""
_S = 1_000_000_000


def samples_of(found: Mapping[Any, Any], field: Field, payloads: Mapping[str, type[Message]]) -> Samples:
    """Times (s) and values of a field, thinned out; empty where nothing of it was recorded.

    Args:
        found: What ``read_columns`` returned.
        field: The field.
        payloads: Payload classes by noun.
    """
    columns = found.get((payloads[field.noun], field.owner))
    if columns is None:
        return np.empty(0), np.empty(0)
    values = columns[field.name]
    if field.place is not None:
        values = values[:, field.place]
    step = max(1, len(values) // MOST_SAMPLES)
    return (columns.stamp_ns * 1e-9)[::step], values[::step].astype(np.float64)


def tracks_of(recording: Recording, vehicles: tuple[str, ...]) -> dict[str, Any]:
    """Poses of each vehicle: t from the beginning (s), x, y (m), heading (rad)."""
    found = read_columns(recording, {VehicleState: ("position_table_m", "heading_rad")})
    tracks = {}
    for (_, owner), columns in found.items():
        if owner in vehicles and len(columns):
            times_s = (columns.stamp_ns - recording.start_ns) / _S
            tracks[owner] = np.column_stack((times_s, columns["position_table_m"], columns["heading_rad"]))
    return tracks


def pose_at(track: Any, t_s: float) -> list[float]:  # noqa: ANN401 an array of four columns
    """x, y (m) and heading (rad) of a track at a time; of its end after that."""
    place = min(int(np.searchsorted(track[:, 0], t_s)), len(track) - 1)
    return [float(value) for value in track[place, 1:]]
