"""A bar on a terminal for what takes seconds."""

import sys
from collections.abc import Callable

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


class RunProgress:
    """A bar on a terminal for what takes seconds; silent elsewhere."""

    def __init__(self, total: float) -> None:
        self._bar = Progress(
            TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), console=Console(stderr=True)
        )
        self._bar.disable = not sys.stderr.isatty()
        self._task = self._bar.add_task("", total=total)

    def __enter__(self) -> Callable[[str, float], None]:
        self._bar.start()
        return lambda text, done: self._bar.update(self._task, description=text, completed=done)

    def __exit__(self, *_: object) -> None:
        self._bar.stop()
