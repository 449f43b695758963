"""Ctrl-C between two steps of a run, not in the middle of one."""

import signal
import threading
from types import FrameType, TracebackType
from typing import Self


class InterruptBetweenSteps:
    """Holds Ctrl-C back until the step is over, so that nodes, laboratory and recorder agree on the moment.

    A second Ctrl-C comes at once. Only Python's own handler is held back, and only in the main thread: who
    has a handler of his own, or runs in another thread, has decided otherwise.

    Attributes:
        is_due: Whether Ctrl-C came.
    """

    def __init__(self) -> None:
        self.is_due = False
        self._holds = False

    def __enter__(self) -> Self:
        is_main = threading.current_thread() is threading.main_thread()
        if is_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._hold)
            self._holds = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._holds:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if self.is_due and kind is None:
            raise KeyboardInterrupt

    def _hold(self, number: int, frame: FrameType | None) -> None:
        if self.is_due:
            signal.default_int_handler(number, frame)
        self.is_due = True
