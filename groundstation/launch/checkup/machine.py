"""The machine itself: its processors' clock, the disk, the clocks, memory, power, the right to go first."""

import ctypes
import os
import resource
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from groundstation.launch.checkup.finding import Finding, Machine, bad, ok, warn

LEAST_FREE_BYTES, FEW_FREE_BYTES = 1_000_000_000, 10_000_000_000
LEAST_MEMORY_KB, FEW_MEMORY_KB = 300_000, 1_000_000
GOOD_CLOCKS = ("tsc", "arch_sys_counter", "kvm-clock", "hyperv_clocksource_tsc_page", "xen")
"""That a reading costs tens of nanoseconds of; hpet and acpi_pm cost a hundred times as much."""
FAR_OFF_S = 0.1
"""Of UTC, at most, where recordings of several hosts are to be laid side by side."""

_GOVERNORS = "sys/devices/system/cpu"
_CLOCK = "sys/devices/system/clocksource/clocksource0/current_clocksource"
_UNSYNCHRONISED = 0x0040  # STA_UNSYNC, <sys/timex.h>
_TIMEX_BYTES, _MAX_ERROR_AT, _STATUS_AT = 208, 24, 40  # struct timex of 64 bits


class KernelClock(NamedTuple):
    """What the kernel knows of its UTC.

    Attributes:
        is_synchronised: Something keeps it.
        max_error_s: How far off it may be.
    """

    is_synchronised: bool
    max_error_s: float


def kernel_clock() -> KernelClock | None:
    """Ask the kernel; None where it cannot be asked."""
    adjtimex = getattr(ctypes.CDLL(None, use_errno=True), "adjtimex", None)
    if adjtimex is None or ctypes.sizeof(ctypes.c_long) != 8:
        return None
    timex = ctypes.create_string_buffer(_TIMEX_BYTES)  # modes = 0: nothing is set
    if adjtimex(timex) < 0:
        return None
    max_error_us = int.from_bytes(timex.raw[_MAX_ERROR_AT : _MAX_ERROR_AT + 8], "little", signed=True)
    status = int.from_bytes(timex.raw[_STATUS_AT : _STATUS_AT + 4], "little")
    return KernelClock(not status & _UNSYNCHRONISED, max_error_us * 1e-6)


def processors(machine: Machine) -> Iterator[Finding]:
    """Whether the processors keep their clock up when nothing is to be done for a millisecond."""
    files = sorted(machine.at(_GOVERNORS).glob("cpu[0-9]*/cpufreq/scaling_governor"))
    governors = Counter(path.read_text(encoding="ascii", errors="replace").strip() for path in files)
    slow = {name: count for name, count in governors.items() if name != "performance"}
    if not governors:
        yield ok("processor clock", "the system does not change it, as in a virtual machine")
    elif not slow:
        yield ok("processor clock", f"the governor of all {len(files)} processors is performance")
    else:
        named = ", ".join(f"{name} of {count}" for name, count in slow.items())
        yield warn(
            "processor clock",
            f"the governor is {named}: waking up takes longer, and stamps are later",
            "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor",
        )


def disk(folder: Path) -> Iterator[Finding]:
    """Whether recordings find room; a folder that is not there yet is made when it is needed."""
    there = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        yield bad("disk", f"{there} cannot be written to", "name another folder: [record] directory = ...")
        return
    found = os.statvfs(there)
    free = found.f_bavail * found.f_frsize
    words = f"{free / 1e9:.1f} GB are free for recordings in {folder}"
    if free < LEAST_FREE_BYTES:
        yield bad("disk", words, "remove old recordings, or name a folder on another disk")
    elif free < FEW_FREE_BYTES:
        yield warn("disk", words, "an hour of two mock-ups without pictures is a few GB: make room")
    else:
        yield ok("disk", words)


def clocks(machine: Machine, ask: Callable[[], KernelClock | None] = kernel_clock) -> Iterator[Finding]:
    """Whether reading the clock is quick, and UTC is kept: stamps are monotonic, recordings state UTC."""
    source = machine.text(_CLOCK)
    if source is None:
        yield ok("clock source", "not named by this system")
    elif source in GOOD_CLOCKS:
        yield ok("clock source", f"{source}, quick to read")
    else:
        yield warn(
            "clock source",
            f"{source}: each stamp costs microseconds",
            "look in dmesg why tsc was given up; often a setting of the BIOS, or tsc=reliable at boot",
        )
    found = ask()
    advice = "sudo timedatectl set-ntp true, and wait a minute; or install chrony"
    if found is None:
        yield warn("UTC", "the kernel does not tell whether something keeps it", advice)
    elif not found.is_synchronised:
        yield warn(
            "UTC",
            "nothing keeps it: recordings of several hosts cannot be laid side by side; a flight needs none",
            advice,
        )
    elif found.max_error_s > FAR_OFF_S:
        yield warn("UTC", f"it is kept, and may be off by {found.max_error_s:.2g} s", advice)
    else:
        yield ok("UTC", f"it is kept, within {1e3 * found.max_error_s:.2g} ms")


def memory(machine: Machine) -> Iterator[Finding]:
    """Whether processes find memory."""
    rows = dict(
        line.split(":", 1) for line in (machine.text("proc/meminfo") or "").splitlines() if ":" in line
    )
    available = rows.get("MemAvailable", "").split()
    if not available or not available[0].isdecimal():
        return
    kilobytes = int(available[0])
    words = f"{kilobytes / 1e6:.1f} GB of memory are available"
    if kilobytes < LEAST_MEMORY_KB:
        yield bad("memory", words, "end other programs")
    elif kilobytes < FEW_MEMORY_KB:
        yield warn("memory", words, "end other programs: a machine that swaps is late")
    else:
        yield ok("memory", words)


def power(machine: Machine) -> Iterator[Finding]:
    """Whether a laptop is plugged in; nothing where there is no battery."""
    supplies = sorted(machine.at("sys/class/power_supply").glob("*"))
    kinds = {path.name: machine.text(f"sys/class/power_supply/{path.name}/type") for path in supplies}
    mains = [name for name, kind in kinds.items() if kind == "Mains"]
    if "Battery" not in kinds.values() or not mains:
        return
    if any(machine.text(f"sys/class/power_supply/{name}/online") == "1" for name in mains):
        yield ok("power", "plugged in")
    else:
        yield warn("power", "it runs on its battery, and saves where it can", "plug it in")


def urgency(
    machine: Machine, limit: Callable[[int], tuple[int, int]] = resource.getrlimit
) -> Iterator[Finding]:
    """Whether what carries a stop may go first."""
    soft, hard = limit(resource.RLIMIT_RTPRIO)
    if machine.uid == 0 or soft != 0 or hard != 0:
        yield ok("going first", "what carries a stop may go before everything else")
    else:
        yield warn(
            "going first",
            "a stop waits its turn like any other process",
            "a line `@users - rtprio 5` in /etc/security/limits.conf, then log in again",
        )
