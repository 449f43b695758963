"""Serial lines: whether they are there, may be used, and how long an FTDI chip keeps bytes back."""

from collections.abc import Iterator

from groundstation.launch.checkup.finding import Finding, Machine, ok, permission, warn

BEST_MS = 1
PATTERNS = ("ttyUSB*", "ttyACM*")


def plugged_in(machine: Machine) -> list[str]:
    """Every serial line behind USB."""
    found = [path for pattern in PATTERNS for path in machine.at("dev").glob(pattern)]
    return sorted(f"/dev/{path.name}" for path in found)


def serial_line(machine: Machine, subject: str, address: str) -> Iterator[Finding]:
    """A line by its path; links such as those in ``/dev/serial/by-id`` are followed."""
    path = machine.at(address)
    trouble = permission(machine, subject, path, address)
    if trouble is not None:
        yield trouble
        return
    name = path.resolve().name
    timer = machine.text(f"sys/bus/usb-serial/devices/{name}/latency_timer")
    if timer is None or not timer.isdecimal():
        yield ok(subject, f"{address} may be used; it has no latency timer")
    elif int(timer) <= BEST_MS:
        yield ok(subject, f"{address} may be used; its latency timer is {timer} ms")
    else:
        yield warn(
            subject,
            f"the latency timer of {address} is {timer} ms: bytes arrive late and in heaps",
            f"echo {BEST_MS} | sudo tee /sys/bus/usb-serial/devices/{name}/latency_timer",
        )
