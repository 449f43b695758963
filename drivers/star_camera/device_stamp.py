"""When a camera's driver had a picture, where it says so: better than when a busy host read it.

V4L2 stamps each buffer by the kernel's monotonic clock; servers such as mjpg-streamer and µStreamer put a
stamp into the part's header `X-Timestamp`, seconds of the monotonic or of the UTC clock of their host. Which
one is not reported, so a stamp counts only if it lies shortly before the arrival.
"""

import math
import time

OLDEST_S = 2.0
"""A picture older than this at its arrival is not believed: then the clock is another one."""
_NS_PER_S = 1_000_000_000


def device_stamp_ns(stamp_s: float, arrival_ns: int, offset_utc_ns: int) -> int | None:
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
    for candidate_ns in (stamp_ns, stamp_ns - offset_utc_ns):
        if 0 <= arrival_ns - candidate_ns <= OLDEST_S * _NS_PER_S:
            return candidate_ns
    return None


def offset_utc_ns() -> int:
    """The host's UTC minus its monotonic clock, good to microseconds."""
    before_ns = time.monotonic_ns()
    utc_ns = time.time_ns()
    return utc_ns - (before_ns + time.monotonic_ns()) // 2
