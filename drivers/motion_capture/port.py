"""A motion-capture system as poses with arrival stamps; which system, the rig's configuration states."""

import json
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from types import TracebackType
from typing import Any, Self

from drivers.errors import DeviceError, LinkLost, NotFound
from drivers.motion_capture.pose import MotionCapturePose
from drivers.motion_capture.reader_lines import Failed, Frame, PoseMaker, Ready, decode

SYSTEMS = ("optitrack", "qualisys", "vicon", "vrpn", "mock")
"""What the library's wheels are built with; `mock` is the library's own stand-in without a network."""
CONNECT_S = 5.0
SILENCE_S = 1.0
_MAX_WAITING = 2048  # poses of a reader that nobody empties; older ones give way
_GRACE_S = 0.5
_SLICE_S = 0.1  # `poses` looks for a close this often


@dataclass(slots=True)
class MotionCaptureCounters:
    """What passed the port since it was opened."""

    frames: int = 0
    poses: int = 0
    """Tracked and untracked."""
    dropped: int = 0
    """Poses that were not read in time."""
    garbled: int = 0
    """Poses whose numbers cannot be right."""
    foreign: int = 0
    """Poses of bodies that were not asked for."""


class MotionCapturePort:
    """Poses of rigid bodies, read by a process that holds the library (`reader` gives the reason).

    Args:
        config: `system`, one of `SYSTEMS`; `hostname`, for `optitrack` as a number like `192.168.1.10`; and
            whatever else the library takes for it, such as `port_command` and `interface_ip` (optitrack) or
            `port` (qualisys).
        bodies: Names of the rigid bodies that are wanted; empty for all.
        connect_s: How long the system may take to answer.
        silence_s: A system that sends no frame for so long is lost.

    Raises:
        ValueError: `system` or `hostname` is missing, or there is no such system.
        NotFound: The library is not installed, or the system does not answer.
    """

    def __init__(
        self,
        config: Mapping[str, Any],
        bodies: Iterable[str] = (),
        *,
        connect_s: float = CONNECT_S,
        silence_s: float = SILENCE_S,
    ) -> None:
        arguments = _checked(config)
        self.name = f"{arguments['system']} at {arguments.get('hostname', 'nowhere')}"
        if find_spec("motioncapture") is None:
            raise NotFound(
                "the library motioncapture is not installed: install the extra mocap "
                "(pip install 'groundstation[mocap]')"
            )
        self._counters = MotionCaptureCounters()
        self._maker = PoseMaker(bodies, is_whole=arguments["system"] != "vrpn")
        self._silence_s = silence_s
        self._news = threading.Condition()
        self._waiting: deque[tuple[int, MotionCapturePose]] = deque()
        self._is_ready = self._is_closed = False
        self._error: DeviceError | None = None
        self._child = subprocess.Popen(
            [sys.executable, "-m", "drivers.motion_capture.reader", json.dumps(arguments), str(connect_s)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # the library talks
            start_new_session=True,  # Ctrl-C is for the parent, who ends this process by closing its stdin
        )
        self._thread = threading.Thread(target=self._listen, name=f"motion capture {self.name}", daemon=True)
        self._thread.start()
        self._wait_until_ready(connect_s)

    @property
    def counters(self) -> MotionCaptureCounters:
        """Counts up to now."""
        with self._news:
            self._counters.garbled, self._counters.foreign = self._maker.garbled, self._maker.foreign
            return self._counters

    def read(self, timeout_s: float) -> tuple[int, MotionCapturePose] | None:
        """The next pose with the host's monotonic stamp of its frame's arrival; None if none came in time.

        Raises:
            LinkLost: The system fell silent or refused, its reader ended, or the port is closed. Opening
                anew is up to the caller.
        """
        give_up_s = time.monotonic() + timeout_s
        with self._news:
            while not self._waiting:
                if self._error is not None:
                    raise LinkLost(str(self._error)) from self._error
                now_s = time.monotonic()
                silent_at_s = self._received_s + self._silence_s
                if now_s >= silent_at_s:
                    raise LinkLost(f"motion capture {self.name} has sent no frame for {self._silence_s:g} s")
                if now_s >= give_up_s:
                    return None
                self._news.wait(min(silent_at_s, give_up_s) - now_s)
            return self._waiting.popleft()

    def poses(self) -> Iterator[tuple[int, MotionCapturePose]]:
        """Every pose with its stamp, until the port is closed.

        Raises:
            LinkLost: As of `read`.
        """
        while not self._is_closed:
            try:
                arrival = self.read(_SLICE_S)
            except LinkLost:
                if self._is_closed:
                    return
                raise
            if arrival is not None:
                yield arrival

    def close(self) -> None:
        """End the reader; may be called twice."""
        with self._news:
            if self._is_closed:
                return
            self._is_closed = True
            self._waiting.clear()
            self._error = self._error or LinkLost(f"motion capture {self.name} is closed")
            self._news.notify_all()
        if self._child.stdin:
            self._child.stdin.close()
        try:
            self._child.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self._thread.join()  # its pipe has ended with the child
        if self._child.stdout:
            self._child.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _wait_until_ready(self, connect_s: float) -> None:
        with self._news:
            self._news.wait_for(lambda: self._is_ready or self._error is not None, connect_s + _START_S)
            self._received_s = time.monotonic()
            is_ready, reason = self._is_ready, self._error
        if not is_ready:
            self.close()
            is_silent = reason is None or self._child.returncode == -_ALARM
            why = f" within {connect_s:g} s" if is_silent else f": {reason}"
            raise NotFound(f"motion capture {self.name} does not answer{why}")

    def _listen(self) -> None:
        error: DeviceError = LinkLost(f"the reader of motion capture {self.name} ended")
        try:
            for line in self._child.stdout or ():
                message = decode(line)
                if isinstance(message, Failed):
                    error = LinkLost(message.reason)
                    return
                self._take(message)
        except ValueError as wrong:  # half a line of a killed reader
            error = LinkLost(
                f"the reader of motion capture {self.name} ended in the middle of a line: {wrong}"
            )
        finally:  # whatever ended the thread, who reads must learn of it
            with self._news:
                self._error = self._error or error
                self._news.notify_all()

    def _take(self, message: Ready | Frame) -> None:
        with self._news:
            self._received_s = time.monotonic()
            if isinstance(message, Ready):
                self._is_ready = True
            else:
                poses = self._maker.poses(message)
                self._waiting.extend((message.stamp_ns, pose) for pose in poses)
                self._counters.frames += 1
                self._counters.poses += len(poses)
                while len(self._waiting) > _MAX_WAITING:
                    self._waiting.popleft()
                    self._counters.dropped += 1
            self._news.notify_all()


_START_S = 10.0  # an interpreter on a busy machine
_ALARM = 14  # SIGALRM, by which the reader ends when the system does not answer; Windows has no name for it


def _checked(config: Mapping[str, Any]) -> dict[str, str]:
    """The configuration in the library's words: texts for everything.

    Raises:
        ValueError: A key is missing, or there is no such system.
    """
    arguments = {
        key: str(int(value)) if isinstance(value, bool) else str(value) for key, value in config.items()
    }
    system = arguments.get("system")
    if system not in SYSTEMS:
        given = "is missing" if system is None else f"is {system!r}"
        raise ValueError(f"motion capture: system {given}; the systems are {', '.join(SYSTEMS)}")
    if system != "mock" and not arguments.get("hostname"):
        raise ValueError(f"motion capture {system} needs the key 'hostname'")
    return arguments
