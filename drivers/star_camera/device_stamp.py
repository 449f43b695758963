"""When a camera's driver had a picture, where it says so: better than when a busy host read it.

V4L2 stamps each buffer by the kernel's monotonic clock; servers such as mjpg-streamer and µStreamer put a
stamp into the part's header `X-Timestamp`, seconds of the monotonic or of the UTC clock of their host. Which
one is not reported. It shows by a stamp shortly before its arrival; from then on stamps of that clock are
believed however old they are, for a picture that waited somewhere is an old one.
"""

import math
import time

FRESH_S = 2.0
"""A stamp at most so old tells which clock it is of."""
OLDEST_MONOTONIC_S = 60.0
"""Until then an older one is not believed to be monotonic: a sender's own clock may count from its start."""
OLDEST_UTC_S = 86_400.0
"""Nor of UTC; no other clock is so near to it."""
_NS_PER_S = 1_000_000_000


class SenderClock:
    """Finds out which clock of this host a sender stamps its pictures by."""

    def __init__(self) -> None:
        self._is_utc: bool | None = None

    def stamp_ns(self, stamp_s: float, arrival_ns: int, offset_utc_ns: int) -> int | None:
        """The driver's stamp on the host's monotonic clock.

        Args:
            stamp_s: What the driver reported, seconds of the monotonic or the UTC clock.
            arrival_ns: When the last byte had been read, monotonic clock.
            offset_utc_ns: The host's UTC minus its monotonic clock.

        Returns:
            Nanoseconds, at most `arrival_ns`; None if the stamp is on neither clock.
        """
        if not math.isfinite(stamp_s):
            return None
        stamp_ns = round(stamp_s * _NS_PER_S)
        candidates_ns = {False: stamp_ns, True: stamp_ns - offset_utc_ns}
        ages_s = {is_utc: (arrival_ns - at_ns) / _NS_PER_S for is_utc, at_ns in candidates_ns.items()}
        if self._is_utc is not None:
            return candidates_ns[self._is_utc] if ages_s[self._is_utc] >= 0.0 else None
        for is_utc, at_ns in candidates_ns.items():
            if 0.0 <= ages_s[is_utc] <= FRESH_S:
                self._is_utc = is_utc
                return at_ns
        for is_utc, oldest_s in ((True, OLDEST_UTC_S), (False, OLDEST_MONOTONIC_S)):
            if 0.0 <= ages_s[is_utc] <= oldest_s:
                return candidates_ns[is_utc]
        return None


def offset_utc_ns() -> int:
    """The host's UTC minus its monotonic clock, good to microseconds."""
    before_ns = time.monotonic_ns()
    utc_ns = time.time_ns()
    return utc_ns - (before_ns + time.monotonic_ns()) // 2
