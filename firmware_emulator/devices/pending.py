"""What is under way to the host."""

from collections import deque
from typing import TypeVar

Item = TypeVar("Item")


def take_until(pending: deque[tuple[int, Item]], until_ns: int) -> list[tuple[int, Item]]:
    """Remove and return what arrives up to `until_ns`; `pending` is ordered by arrival stamp."""
    taken = []
    while pending and pending[0][0] <= until_ns:
        taken.append(pending.popleft())
    return taken
