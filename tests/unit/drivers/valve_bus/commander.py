"""Somebody who commands a guard: what the tests of the guard share."""

from drivers.valve_bus.guard import OpenTimeLimits
from drivers.valve_bus.messages import ValveCommand

MS = 1_000_000
WIDE = OpenTimeLimits(max_open_s=100.0, max_duty_ratio=1.0, duty_window_s=100.0)
CLOSED = (0,) * 8
ONE = (50, 0, 0, 0, 0, 0, 0, 0)


class Source:
    """Somebody who commands every 20 ms and ticks right after."""

    def __init__(self, guard, start_ms=0):
        self.guard, self.now_ms, self.counter, self.pulse_id = guard, start_ms, 0, 0

    def say(self, on_times_ms=None, step=1):
        self.counter = (self.counter + step) % 16
        if on_times_ms is not None:
            self.pulse_id = (self.pulse_id + 1) % 16
            self.times = on_times_ms
        times = getattr(self, "times", CLOSED)
        return self.guard.update(self.now_ms * MS, ValveCommand(1, self.counter, self.pulse_id, times))

    def tick(self, later_ms=0):
        self.now_ms += later_ms
        return self.guard.tick(self.now_ms * MS)
