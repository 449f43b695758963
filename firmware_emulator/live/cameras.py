"""The camera process as its parent sees it."""

import json
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict

from firmware_emulator.devices.star_camera import Exposure
from firmware_emulator.live.tcp_server import LOOPBACK
from firmware_emulator.sky.scene import SceneError

_GRACE_S = 0.5


class CameraProcess:
    """Starts the process that draws and serves pictures, and tells it what to draw.

    Args:
        rows: One table per camera: name, ceiling, camera, exposure_s, readout_s, sky_seed, camera_seed,
            jpeg_quality.

    Raises:
        SceneError: A file of a camera cannot be read, or the process did not start.
    """

    def __init__(self, rows: Sequence[dict[str, object]]) -> None:
        self._child = subprocess.Popen(
            [sys.executable, "-m", "firmware_emulator.live.camera_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            self._say(list(rows))
            answer = json.loads(self._child.stdout.readline()) if self._child.stdout else {}
        except (OSError, ValueError) as error:
            self.close()
            raise SceneError("the camera process did not start") from error
        if "port" not in answer:
            self.close()
            raise SceneError(str(answer.get("error", "the camera process did not start")))
        self._port = int(answer["port"])

    def url(self, name: str, stream: str) -> str:
        """Where the pictures of vehicle `name` are served; `stream` is raw or mjpeg."""
        return f"http://{LOOPBACK}:{self._port}/{name}.{stream}"

    def order(self, name: str, exposure: Exposure) -> None:
        """Ask for a picture.

        Raises:
            OSError: The process is gone.
        """
        self._say([name, asdict(exposure)])

    def close(self) -> None:
        """End the process; may be called twice."""
        for pipe in (self._child.stdin, self._child.stdout):
            if pipe:
                with suppress(OSError):  # it died first
                    pipe.close()
        try:
            self._child.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()

    def _say(self, message: object) -> None:
        if self._child.stdin is None:
            raise BrokenPipeError("the camera process has no stdin")
        self._child.stdin.write(json.dumps(message) + "\n")
        self._child.stdin.flush()
