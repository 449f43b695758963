"""Progress on a terminal's stderr, nothing elsewhere."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")
Progress = Callable[[str, float], None]
"""Takes what is going on and how much of it is done, 0 to 1; NaN where nobody knows."""


def silent(what: str, share: float) -> None:
    """Show no progress."""
    del what, share


def with_progress(frames: Sequence[T], what: str) -> Iterator[T]:
    """Iterate with a progress bar."""
    from rich.console import Console  # 50 ms, where a bar may be seen
    from rich.progress import track

    console = Console(stderr=True)
    yield from track(
        frames, description=what, console=console, disable=not console.is_terminal, transient=True
    )


@contextmanager
def progress_line() -> Iterator[Progress]:
    """Show progress as one line."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield silent
        return
    with console.status("") as status:

        def show(what: str, share: float) -> None:
            status.update(what if math.isnan(share) else f"{what}: {100.0 * share:.0f} %")

        yield show
