"""CPU time of an estimator per packet and per late fix, on one data set."""

import math
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

from bench.unit import blur_s, picture
from groundstation.data_sets.fusion_folder import read_folder
from groundstation.fusion.estimator import EstimatorFactory, Fix, ImuPacket

NS = 1e9


@dataclass(frozen=True, slots=True)
class Pace:
    """CPU time of an estimator.

    Attributes:
        packet_s: Per packet.
        fix_s: Per late fix.
        unit_s: Of the small unit, taken after every fix.
    """

    packet_s: float
    fix_s: float
    unit_s: float


def pace(folder: Path, factory: EstimatorFactory, repeats: int) -> Pace:
    """Feed the packets between two fixes, then the fix, and take the best of whole runs: noise only adds."""
    data = read_folder(folder)
    period_s = data.noise.packet_period_s
    packets = [ImuPacket(round(row[0] * NS), period_s, *row[1:5]) for row in data.imu.tolist()]
    covariance = np.diag([data.noise.star_sigma_xy_m**2] * 2 + [data.noise.star_sigma_heading_rad**2])
    fixes = [
        Fix(round(row[0] * NS), round(row[1] * NS), *row[2:5], covariance) for row in data.stars.tolist()
    ]
    image = picture()
    best = [math.inf] * 3
    for _ in range(repeats):
        estimator = factory(data.noise)
        estimator.begin_rest(0)
        spent, fed, is_resting = [0.0] * 3, 0, True
        for fix in fixes:
            first = fed
            while fed < len(packets) and packets[fed].t_ns < fix.t_arrival_ns:
                fed += 1
            began = process_time()
            for packet in packets[first:fed]:
                estimator.add_imu(packet)
            spent[0] += process_time() - began
            if is_resting and fix.t_arrival_ns > data.run_start_s * NS:
                estimator.end_rest(round(data.run_start_s * NS))
                is_resting = False
            began = process_time()
            estimator.add_fix(fix)
            spent[1] += process_time() - began
            spent[2] += blur_s(image)
        best = [min(b, s / n) for b, s, n in zip(best, spent, (fed, len(fixes), len(fixes)), strict=True)]
    return Pace(*best)
