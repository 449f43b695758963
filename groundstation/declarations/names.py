"""What names that people give may look like: they become keys on the bus and channels of recordings."""

import re

PATTERN = "[a-z][a-z0-9_]*"
"""Of vehicles, processes, parts, topics and nodes."""
LOOKS = "small letters, digits and underscores, beginning with a letter"

RECORDER, LABORATORY, LAUNCHER, CONSOLE = "recorder", "laboratory", "launcher", "console"
FOXGLOVE, ROS2 = "foxglove", "ros2"
OF_THE_BUS = frozenset({"rig", "record", "alive", "all"})
"""First words of keys on the bus and of requests that stand for neither a vehicle nor a process."""
OF_THE_LAUNCHER = frozenset(
    {RECORDER, LABORATORY, LAUNCHER, CONSOLE, FOXGLOVE, ROS2, "hub", "fork_server", "lockstep"}
)
"""Processes that run no nodes of a rig."""

_NAME = re.compile(PATTERN)


def is_name(given: object) -> bool:
    """Whether it may be the name of something."""
    return isinstance(given, str) and _NAME.fullmatch(given) is not None


def process_trouble(given: object) -> str:
    """Why nodes cannot run in a process of this name; empty if they can."""
    if not is_name(given):
        return f"{given!r} is no name of a process: expected {LOOKS}"
    if given in OF_THE_BUS:
        return f"{given!r} has a meaning on the bus: choose another process name"
    if given in OF_THE_LAUNCHER:
        return f"{given!r} is the ground station's own and runs no nodes: choose another process name"
    return ""
