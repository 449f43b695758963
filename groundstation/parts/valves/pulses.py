"""When valves were open, from the guard's commands, and what that gave. Pure."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def open_s(t_s: Array, on_time_s: Array) -> Array:
    """How long each valve is open after each command, until the next one replaces it.

    Args:
        t_s: Stamps of the commands, ascending; shape (n,).
        on_time_s: Remaining on-time of each valve that a command states; shape (n, valves).

    Returns:
        Seconds, shape (n, valves); delays of opening and closing are not in it.
    """
    following_s = np.append(np.diff(t_s), np.inf)
    found: Array = np.minimum(on_time_s, following_s[:, None])
    return found


def impulse_ns(t_s: Array, on_time_s: Array, thrust_n: float) -> Array:
    """Newton-seconds of all valves together up to the end of each command, at nominal thrust; shape (n,)."""
    found: Array = thrust_n * np.cumsum(open_s(t_s, on_time_s).sum(axis=1))
    return found
