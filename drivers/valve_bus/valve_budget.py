"""How long one valve may stay open: a limit per run and a limit on average."""

from dataclasses import dataclass
from enum import StrEnum

_NS_PER_S = 1_000_000_000
NS_PER_MS = 1_000_000


@dataclass(frozen=True, slots=True)
class OpenTimeLimits:
    """What a valve may do whatever is commanded; rig data, checked on construction.

    Attributes:
        max_open_s: Longest run. Openings parted by less than `min_rest_s` are one run, since a solenoid needs
            some 5 ms to close and would not notice a shorter pause.
        min_rest_s: Closed time that ends a run.
        max_duty_ratio: Open time on average, 0 (never) to 1 (no limit).
        duty_window_s: In any span T the valve is open for at most `max_duty_ratio * (T + duty_window_s)`.
    """

    max_open_s: float = 2.0
    min_rest_s: float = 0.02
    max_duty_ratio: float = 0.6
    duty_window_s: float = 10.0

    def __post_init__(self) -> None:
        for name in ("max_open_s", "min_rest_s", "duty_window_s"):
            if not 0.0 < getattr(self, name) < 3600.0:
                raise ValueError(f"{name} is a span between 0 and 3600 s, got {getattr(self, name)}")
        if not 0.0 <= self.max_duty_ratio <= 1.0:
            raise ValueError(f"max_duty_ratio is between 0 and 1, got {self.max_duty_ratio}")


class Clip(StrEnum):
    """Why a valve was granted less than it was asked for."""

    RUN = "run"
    DUTY = "duty"


class ValveBudget:
    """Open time of one valve as the guard granted it; stamps must not go backwards."""

    def __init__(self, limits: OpenTimeLimits) -> None:
        self._max_open_ns = round(limits.max_open_s * _NS_PER_S)
        self._min_rest_ns = round(limits.min_rest_s * _NS_PER_S)
        self._duty_ratio = limits.max_duty_ratio
        self._capacity_ns = int(limits.max_duty_ratio * limits.duty_window_s * _NS_PER_S)
        self._savings_ns = (
            self._capacity_ns
        )  # open time left: refilled at the duty ratio, spent by being open
        self._settled_ns: int | None = None
        self._run_since_ns: int | None = None
        self._close_at_ns = 0

    def is_open(self, stamp_ns: int) -> bool:
        """Open by what was granted."""
        return self._run_since_ns is not None and self._close_at_ns > stamp_ns

    def remaining_ms(self, stamp_ns: int) -> int:
        """Whole milliseconds for which the valve is still open; 0 when closed."""
        return (self._close_at_ns - stamp_ns) // NS_PER_MS if self.is_open(stamp_ns) else 0

    def cut(self, stamp_ns: int) -> bool:
        """Close now; True if it was open."""
        self._settle(stamp_ns)
        was_open = self.is_open(stamp_ns)
        if was_open:
            self._close_at_ns = stamp_ns
        return was_open

    def grant(self, stamp_ns: int, on_time_ms: int) -> tuple[int, Clip | None]:
        """Open from now for as much of `on_time_ms` as the limits leave, in place of what was granted before.

        Returns:
            The granted on-time in ms (0 closes), and the limit that clipped it, if one did.
        """
        self.cut(stamp_ns)
        run_since_ns = self._run_since_ns
        if run_since_ns is None or stamp_ns - self._close_at_ns >= self._min_rest_ns:
            run_since_ns = stamp_ns
        run_left_ms = max(0, run_since_ns + self._max_open_ns - stamp_ns) // NS_PER_MS
        savings_ms = self._savings_ns // NS_PER_MS
        granted_ms = min(on_time_ms, run_left_ms, savings_ms)
        if granted_ms > 0:
            self._run_since_ns = run_since_ns
            self._close_at_ns = stamp_ns + granted_ms * NS_PER_MS
        if granted_ms == on_time_ms:
            return granted_ms, None
        return granted_ms, Clip.RUN if run_left_ms <= savings_ms else Clip.DUTY

    def _settle(self, stamp_ns: int) -> None:
        """Book what was open and closed since the last booking."""
        if self._settled_ns is not None:
            elapsed_ns = stamp_ns - self._settled_ns
            open_ns = max(0, min(self._close_at_ns, stamp_ns) - self._settled_ns)
            self._savings_ns += int(self._duty_ratio * open_ns) - open_ns
            refill_ns = int(self._duty_ratio * (elapsed_ns - open_ns))
            self._savings_ns = min(self._capacity_ns, self._savings_ns + refill_ns)
        self._settled_ns = stamp_ns
