"""The guard, the one gate before the valves, asked with numbers: time is an argument, nothing is waited for.

python examples/ask_the_guard.py
"""

from drivers.valve_bus.guard import Guard
from drivers.valve_bus.messages import ValveCommand
from drivers.valve_bus.valve_budget import OpenTimeLimits

MS = 1_000_000
PULSE = (50, 0, 0, 0, 0, 0, 0, 0)
"""Valve 0 for 50 ms."""


def main() -> None:
    """A story of 300 ms."""
    guard = Guard(vehicle=0, limits=OpenTimeLimits())
    counter = 0

    def tell(now_ms: int, pulse_id: int) -> None:
        nonlocal counter
        counter = (counter + 1) % 16
        guard.update(now_ms * MS, ValveCommand(0, counter, pulse_id, PULSE))

    def show(now_ms: int, what: str) -> None:
        output = guard.tick(now_ms * MS)
        times = output.command.on_times_ms
        print(f"{now_ms:4d} ms  gate {output.gate.value:9s} valve 0 for {times[0]:3d} ms  {what}")

    tell(0, pulse_id=1)
    show(0, "a pulse is asked for, but nobody armed")
    guard.arm(10 * MS)
    show(10, "armed: what was asked for before is forgotten")
    tell(20, pulse_id=1)
    show(20, "the same pulse again opens nothing: its id is not new")
    tell(40, pulse_id=2)
    show(40, "a new pulse")
    tell(60, pulse_id=2)
    show(60, "refreshed: what remains is sent")
    tell(80, pulse_id=3)
    show(80, "the next pulse, then silence")
    show(100, "20 ms of silence")
    show(180, "100 ms of silence: stale, closed")
    tell(200, pulse_id=4)
    show(200, "one command does not end a silence")
    tell(220, pulse_id=5)
    show(220, "two in sequence do")


if __name__ == "__main__":
    main()
