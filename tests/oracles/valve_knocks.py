"""What switching valves add to the noise: a knock that the accelerometers read and nothing moves by."""

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.error_state import PX, PY, VX, VY
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import Segment
from groundstation.fusion.valve_knocks import group_of, step_of
from oracles.flight import Flight

Array = NDArray[np.float64]


def add_knocks(Q: Array, segment: Segment, flight: Flight, noise: NoiseModel) -> None:
    """Add to the process covariance Q (5, 5), in place, one knock wherever the force changes abruptly."""
    group = group_of(noise)
    count = len(segment.span_s) // group
    if count < 2:
        return
    force, until_end_s = flight.force_body, flight.until_end_s
    if group > 1:
        force = force[:, : count * group].reshape(2, count, group).mean(axis=2)
        until_end_s = until_end_s[: count * group : group]
    left = until_end_s[1:][(np.abs(force[:, 1:] - force[:, :-1]) > step_of(noise)).any(axis=0)]
    knock = noise.valve_knock_m_s**2
    vv, vp, pp = knock * len(left), knock * float(left.sum()), knock * float(left @ left)
    for v, p in ((VX, PX), (VY, PY)):
        Q[v, v] += vv
        Q[v, p] += vp
        Q[p, v] += vp
        Q[p, p] += pp
