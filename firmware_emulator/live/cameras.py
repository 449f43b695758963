"""The camera process as its parent sees it."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from typing import Any

from firmware_emulator.device_kind import PictureOrder
from firmware_emulator.live.tcp_server import LOOPBACK
from firmware_emulator.scene_files import SceneError

_GRACE_S = 0.5
_BACK_OFF_S = 2.0


class CameraProcess:
    """Starts the process that draws and serves pictures, and tells it what to draw.

    The caller paces serial lines, so it is never made to wait: an order that the process does not take is
    dropped, and a process that died is started again on the same port without waiting for it.

    Args:
        orders: What is to be drawn, one per camera.

    Raises:
        SceneError: A file of a camera cannot be read, or the process did not start.

    Attributes:
        dropped_orders: Pictures that were not ordered because the process was dead or stuck.
        restarts: How often it was started again.
    """

    def __init__(self, orders: Sequence[PictureOrder]) -> None:
        self._rows = [asdict(order) for order in orders]
        self.dropped_orders = 0
        self.restarts = 0
        self._port = 0
        self._child = self._start()
        try:
            answer = json.loads(self._child.stdout.readline()) if self._child.stdout else {}
        except ValueError:
            answer = {}
        except BaseException:  # somebody wants us to end before it is up
            self.close()
            raise
        if "port" not in answer:
            self.close()
            raise SceneError(str(answer.get("error", "the camera process did not start")))
        self._port = int(answer["port"])

    def url(self, name: str, stream: str) -> str:
        """Where the pictures of camera `name` are served; `stream` is raw or mjpeg."""
        return f"http://{LOOPBACK}:{self._port}/{name}.{stream}"

    def order(self, name: str, exposure: Any) -> None:  # noqa: ANN401 - a dataclass of the renderer's
        """Ask for a picture."""
        if not self._say([name, asdict(exposure)]):
            self.dropped_orders += 1
            if self._child.poll() is not None and time.monotonic() > self._started_s + _BACK_OFF_S:
                self._release()
                self._child = self._start()
                self.restarts += 1

    def close(self) -> None:
        """End the process; may be called twice."""
        self._release()
        try:
            self._child.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()

    def _start(self) -> subprocess.Popen[bytes]:
        self._started_s = time.monotonic()
        self._child = subprocess.Popen(
            [sys.executable, "-m", "firmware_emulator.live.camera_process", str(self._port)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is for the parent, who ends this process by closing its stdin
        )
        if self._child.stdin:
            os.set_blocking(self._child.stdin.fileno(), False)
        self._say(self._rows)
        return self._child

    def _say(self, message: object) -> bool:
        """Write a line whole or not at all; whether it was taken."""
        line = (json.dumps(message) + "\n").encode()
        pipe = self._child.stdin
        if pipe is None or pipe.closed:
            return False
        try:
            return os.write(pipe.fileno(), line) == len(line)  # a pipe takes lines below 4 kB whole
        except OSError:
            return False

    def _release(self) -> None:
        for pipe in (self._child.stdin, self._child.stdout):
            if pipe:
                with suppress(OSError):  # it died first
                    pipe.close()
