"""Whether fixes come, and whether they come from pictures that are new. Pure."""

import math
from collections import deque
from collections.abc import Iterator
from statistics import median

SHORTEST_OUTAGE_S, UNKNOWN_OUTAGE_S = 0.5, 3.0
KNOWN_INTERVALS = 3
"""So many intervals between fixes say how often they usually come."""
PERIODS = 3.0
LASTING_S = 1.0
RARE_OVER_S, RARE_SHARE, OFTEN_HZ = 2.0, 0.45, 5.0
"""Over so long fixes that usually come often come less than this share of their usual number."""
REFUSED_IN_A_ROW = 8
USUAL_GAIN = 0.002
"""Of the usual rate, each time it is asked: a minute or so."""
_INTERVALS = 9
REPEATS, TORN = "repeat", "torn picture"
"""What the reasons of pictures and fixes hold."""


class FixWatch:
    """Follows fixes and what became of them."""

    def __init__(self) -> None:
        self._used_ns: int | None = None
        self._exposure_ns: int | None = None
        self._recent_ns: deque[int] = deque(maxlen=256)
        self._intervals_s: deque[float] = deque(maxlen=_INTERVALS)
        self._interval_s = math.inf  # their median
        self._refused = 0
        self._usual_hz = 0.0
        self._marks: dict[str, tuple[int, str]] = {}

    def take_account(self, now_ns: int, exposure_ns: int, *, is_used: bool, reason: str) -> None:
        """Account for what fusion did with a fix; several that waited may come at one moment."""
        if is_used:
            if self._exposure_ns is not None and exposure_ns > self._exposure_ns:
                self._intervals_s.append((exposure_ns - self._exposure_ns) * 1e-9)
                self._interval_s = median(self._intervals_s)
            self._used_ns, self._exposure_ns = now_ns, exposure_ns
            self._recent_ns.append(now_ns)
            self._refused = 0
        elif REPEATS in reason:
            self._marks["camera_frozen"] = now_ns, reason
        else:
            self._refused += 1
            if self._refused >= REFUSED_IN_A_ROW:
                self._marks["wrong_fixes"] = now_ns, f"{self._refused} refused in a row: {reason}"

    def take_picture(self, now_ns: int, reason: str) -> None:
        """Account for a picture without a fix."""
        if REPEATS in reason:
            self._marks["camera_frozen"] = now_ns, reason
        elif TORN in reason:
            self._marks["camera_torn"] = now_ns, reason

    def findings(self, now_ns: int) -> Iterator[tuple[str, str]]:
        """Faults at this moment, by id with details; no outage before the first fix was used."""
        for fault, (seen_ns, detail) in self._marks.items():
            if now_ns - seen_ns < LASTING_S * 1e9:
                yield fault, detail
        if self._used_ns is None:
            return
        longest_s = UNKNOWN_OUTAGE_S
        if len(self._intervals_s) >= KNOWN_INTERVALS:
            longest_s = max(SHORTEST_OUTAGE_S, PERIODS * self._interval_s)
        age_s = (now_ns - self._used_ns) * 1e-9
        if age_s > longest_s:
            yield "star_outage", f"no fix for {age_s:.1f} s"
            return
        yield from self._rarity(now_ns)

    def _rarity(self, now_ns: int) -> Iterator[tuple[str, str]]:
        while self._recent_ns and now_ns - self._recent_ns[0] > RARE_OVER_S * 1e9:
            self._recent_ns.popleft()
        if len(self._intervals_s) < _INTERVALS:
            return
        now_hz = 1.0 / self._interval_s
        self._usual_hz += USUAL_GAIN * (now_hz - self._usual_hz) if self._usual_hz else now_hz
        found_hz = len(self._recent_ns) / RARE_OVER_S
        if self._usual_hz >= OFTEN_HZ and found_hz < RARE_SHARE * self._usual_hz:
            yield "fixes_rare", f"{found_hz:.0f} a second, usually {self._usual_hz:.0f}"
