"""Thrust falls with open valves: the regulator sags by one factor per further open valve."""

import itertools
from collections.abc import Sequence

Span = tuple[float, float]
"""From and to, in any unit of time; empty where it does not end after it begins."""


def sag_factor(open_valves: float, sag: float) -> float:
    """Of the thrust of each valve, while so many are open; shares of thrust count as shares of a valve."""
    return float(sag ** (open_valves - 1.0)) if open_valves > 1.0 else 1.0


def sagged_spans(
    spans: Sequence[Span],
    open_shares: Sequence[float],
    shut_shares: Sequence[float],
    period: float,
    sag: float,
) -> tuple[list[float], float]:
    """How long valves would be open without a sag to give the same impulse.

    Args:
        spans: When each valve is open.
        open_shares: Share of the rig's thrust that each gives then.
        shut_shares: And all the rest of the time.
        period: Length of what is looked at, from zero; spans may end later.
        sag: Factor per further open valve.

    Returns:
        For each valve the part of its span; for those that do not shut the part of the period.
    """
    changes = {moment for span in spans if span[1] > span[0] for moment in span}
    moments = sorted({0.0, period} | changes)
    opened = [0.0] * len(spans)
    idle = 0.0
    for begin, end in itertools.pairwise(moments):
        is_open = [span[0] <= begin and end <= span[1] for span in spans]
        crowd = sum(
            full if opens else rest
            for opens, full, rest in zip(is_open, open_shares, shut_shares, strict=True)
        )
        length = (end - begin) * sag_factor(crowd, sag)
        if end <= period:
            idle += length
        for valve, opens in enumerate(is_open):
            if opens:
                opened[valve] += length
    return opened, idle
