"""Keys of a run on a terminal: the space bar stops all, l lands all, q ends. Read only where stdin is one."""

import os
import select
import signal
import sys
import termios
import threading
import tty
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any, Self

from groundstation.declarations.errors import GroundStationError
from groundstation.launch.asking import publish, requests_of, session_with
from groundstation.launch.stop_button import REPEAT_S, StopButton
from groundstation.launch.urgency import going_first

HELP = "space: stop all   l: land all   q: end"
BACKGROUND_S = 0.5
"""How long a run in the background, which must not read, waits before it looks again."""


def stdin_descriptor() -> int:
    """Of stdin; one that is no terminal where there is none."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, ValueError, OSError):  # closed, or replaced by what is no file
        return -1


class Keys:
    """Reads keys in a thread while the context lasts; the terminal is as before afterwards.

    Args:
        descriptor: Of what may be a terminal.
        endpoint: Of the hub.
        vehicles: Names of all vehicles.
        author: In whose name.
        note: Takes a line for people; called from the thread.
        end: Called at q, from the thread.

    Attributes:
        are_read: Whether it is a terminal.
    """

    def __init__(
        self,
        descriptor: int,
        endpoint: str,
        vehicles: tuple[str, ...],
        author: str,
        note: Callable[[str], None],
        end: Callable[[], None],
    ) -> None:
        self._descriptor = descriptor
        self._endpoint = endpoint
        self._vehicles = vehicles
        self._author = author
        self._note = note
        self._end = end
        self._before: list[Any] | None = None
        self._ending, self._waker = os.pipe()
        self._thread = threading.Thread(target=self._run, name="keys", daemon=True)
        self.are_read = os.isatty(descriptor)

    def __enter__(self) -> Self:
        if self.are_read:
            self._before = termios.tcgetattr(self._descriptor)
            self._take_terminal()
            self._continued = signal.signal(signal.SIGCONT, self._take_terminal)
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.write(self._waker, b".")
        if self._before is not None:
            self._thread.join()
            signal.signal(signal.SIGCONT, self._continued)
            if self._is_in_foreground():
                termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)
        os.close(self._ending)
        os.close(self._waker)

    def _take_terminal(self, number: int = 0, frame: FrameType | None = None) -> None:
        """Keys at once and unseen; again after a pause (Ctrl-Z, fg), since the shell has taken it back."""
        del number, frame
        if self._is_in_foreground():
            tty.setcbreak(self._descriptor, termios.TCSADRAIN)

    def _is_in_foreground(self) -> bool:
        """Whether the terminal may be read and set: a run in the background would be halted for it."""
        try:
            return os.tcgetpgrp(self._descriptor) == os.getpgrp()
        except OSError:  # not the terminal that controls this process: nobody halts it
            return True

    def _run(self) -> None:
        try:
            with going_first(), session_with(self._endpoint) as bus:
                button = StopButton(bus, self._vehicles, self._author)
                while True:
                    wait_s = 0.0 if button.is_pending else None
                    ready, _, _ = select.select([self._descriptor, self._ending], [], [], wait_s)
                    if self._ending in ready:
                        return
                    if not ready:
                        button.follow(REPEAT_S / 2)
                    elif not self._is_in_foreground():
                        select.select([self._ending], [], [], BACKGROUND_S)
                    else:
                        pressed = os.read(self._descriptor, 64)
                        if not pressed:
                            return
                        for key in pressed.decode(errors="replace").lower():
                            if key == " ":
                                button.press()
                            elif key == "l":
                                for request in requests_of(self._vehicles, "land", {}, self._author):
                                    publish(bus, request)
                            elif key == "q":
                                self._end()
        except (GroundStationError, OSError) as error:
            self._note(f"keys are not read any more: {error}")
