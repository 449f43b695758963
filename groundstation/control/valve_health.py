"""What a valve gives, over what the rig states: as it is while commanded open, and while commanded shut."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEAST_SHARE = 0.05
"""A valve whose command changes less of its thrust than this is left out: it could not be counted on."""
MOST_SHARE = 2.0


@dataclass(frozen=True, slots=True)
class ValveHealth:
    """Shares of the rig's thrust.

    Attributes:
        open_share: While commanded open: 1 for a healthy valve, less for a weak one.
        shut_share: While commanded shut: 0 unless it leaks or is stuck open.

    Raises:
        ValueError: A share is not within 0 and `MOST_SHARE`, or a shut valve gives more than an open one.
    """

    open_share: float = 1.0
    shut_share: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.shut_share <= self.open_share <= MOST_SHARE:
            raise ValueError(
                f"shares of thrust must be 0 <= shut <= open <= {MOST_SHARE:g}, "
                f"found shut {self.shut_share} and open {self.open_share}"
            )

    @property
    def obeys(self) -> bool:
        """Whether a command makes a difference."""
        return self.open_share - self.shut_share >= LEAST_SHARE


HEALTHY = ValveHealth()
STUCK_CLOSED = ValveHealth(0.0, 0.0)


def weak(gain: float) -> ValveHealth:
    """A valve that gives this share of its thrust."""
    return ValveHealth(gain, 0.0)


def stuck_open(share: float = 1.0) -> ValveHealth:
    """A valve that gives this share of its thrust whatever is commanded."""
    return ValveHealth(share, share)


def leaking(share: float) -> ValveHealth:
    """A valve that gives this share while shut, and all of its thrust while open."""
    return ValveHealth(max(1.0, share), share)


def health_of(open_shares: Sequence[float], shut_shares: Sequence[float]) -> tuple[ValveHealth, ...]:
    """States of health from what a message states.

    Raises:
        ValueError: See `ValveHealth`, or the lengths differ.
    """
    return tuple(ValveHealth(each, rest) for each, rest in zip(open_shares, shut_shares, strict=True))


def shares(health: Sequence[ValveHealth], valves: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What commands add, and what comes without one, both as shares of the rig's thrust, shape (n,).

    Raises:
        ValueError: There are not as many states as valves.
    """
    if len(health) != valves:
        raise ValueError(f"each of {valves} valves needs a state of health, found {len(health)}")
    added = [valve.open_share - valve.shut_share if valve.obeys else 0.0 for valve in health]
    return np.array(added), np.array([valve.shut_share for valve in health])
