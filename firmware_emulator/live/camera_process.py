"""Draws the pictures of all cameras and serves them over HTTP, in a process of its own.

Drawing takes milliseconds of CPU; in the process that paces the serial lines it would delay bytes. The
parent writes on stdin, one JSON line each, first what cameras there are, then every exposure; end of file
ends this process. On stdout it reports its port once.
"""

import json
import os
import sys
import threading
import time
from collections import deque
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.files.errors import FileError
from firmware_emulator.device_kind import PictureOrder, Renderer
from firmware_emulator.live.tcp_server import LOOPBACK

BOUNDARY = "picture"
NS_PER_S = 1_000_000_000
NICENESS = 10
"""On a busy machine bytes, filters and valves go first; a late picture still carries its stamp."""
_MAX_ORDERS = 64  # more than a second of the slowest pipeline; behind that, old pictures give way to new ones


class LiveCamera:
    """Pictures of one camera, each published when it is due; who is slow misses pictures.

    Args:
        renderer: Draws.
        jpeg_quality: For the MJPEG stream.
    """

    def __init__(self, renderer: Renderer, jpeg_quality: int) -> None:
        self._renderer = renderer
        self._jpeg_quality = jpeg_quality
        self._changed = threading.Condition()
        self._orders: deque[Any] = deque(maxlen=_MAX_ORDERS)
        self._newest: tuple[int, int, NDArray[np.uint8]] | None = None
        self._published = 0
        threading.Thread(target=self._work, daemon=True).start()

    def order(self, fields: dict[str, Any]) -> None:
        """Ask for the picture of an exposure, given as what `dataclasses.asdict` made of it."""
        exposure = self._renderer.exposure(fields)
        with self._changed:
            self._orders.append(exposure)
            self._changed.notify_all()

    def wait(self, seen: int) -> tuple[int, int, int, NDArray[np.uint8]]:
        """Block for a picture newer than number `seen`; return its number, sequence, stamp (ns) and image."""
        with self._changed:
            self._changed.wait_for(lambda: self._published > seen)
            if self._newest is None:
                raise RuntimeError("published without a picture")
            return self._published, *self._newest

    def part(self, sequence: int, stamp_ns: int, image: NDArray[np.uint8], is_jpeg: bool) -> bytes:
        """One part of the multipart stream, stamped as camera servers do."""
        height, width = image.shape[:2]
        if is_jpeg:
            kind = "image/jpeg"
            body = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, self._jpeg_quality])[1].tobytes()
        else:
            kind = "application/x-mono8" if image.ndim == 2 else "application/x-bgr8"
            body = image.tobytes()
        head = (
            f"--{BOUNDARY}\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n"
            f"X-Width: {width}\r\nX-Height: {height}\r\nX-Sequence: {sequence}\r\n"
            f"X-Timestamp: {stamp_ns / NS_PER_S:.6f}\r\n\r\n"
        )
        return head.encode("ascii") + body + b"\r\n"

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: bool(self._orders))
                now_ns = time.monotonic_ns()
                while len(self._orders) > 1 and self._orders[0].arrival_ns < now_ns:
                    self._orders.popleft()  # too slow a machine misses pictures, not the present
                exposure = self._orders.popleft()
            image = self._renderer.render(exposure)
            wait_ns = max(0, exposure.arrival_ns - time.monotonic_ns())
            time.sleep(wait_ns / NS_PER_S)  # real time: a frame leaves when a camera would have sent it
            with self._changed:
                self._newest = (exposure.sequence, exposure.arrival_ns, image)
                self._published += 1
                self._changed.notify_all()


def make_server(cameras: dict[str, LiveCamera], port: int = 0) -> ThreadingHTTPServer:
    """A server on a loopback port (0: a free one): `/<camera>.raw` and `/<camera>.mjpeg`."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            name, _, kind = self.path.lstrip("/").partition(".")
            if name not in cameras or kind not in ("raw", "mjpeg"):
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            self.close_connection = True
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={BOUNDARY}")
            self.send_header("Cache-Control", "no-store")
            self.send_header("Connection", "close")
            self.end_headers()
            self._stream(cameras[name], is_jpeg=kind == "mjpeg")

        def _stream(self, camera: LiveCamera, is_jpeg: bool) -> None:
            seen = 0
            try:
                while True:
                    seen, sequence, stamp_ns, image = camera.wait(seen)
                    self.wfile.write(camera.part(sequence, stamp_ns, image, is_jpeg))
            except OSError:  # the client left: its right
                return

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - http.server's name
            return

    class Server(ThreadingHTTPServer):
        daemon_threads = True
        block_on_close = False

    return Server((LOOPBACK, port), Handler)


def main(port: int) -> int:
    """Serve on a port (0: a free one) until stdin ends."""
    cv2.setNumThreads(1)
    os.nice(NICENESS)
    cameras: dict[str, LiveCamera] = {}
    try:
        for row in json.loads(sys.stdin.readline()):
            order = PictureOrder(**row)
            cameras[order.name] = LiveCamera(order.load(), order.jpeg_quality)
    except FileError as error:
        print(json.dumps({"error": str(error)}), flush=True)  # noqa: T201 - the answer to the parent
        return 2
    server = make_server(cameras, port)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    print(json.dumps({"port": server.server_address[1]}), flush=True)  # noqa: T201 - likewise
    for line in sys.stdin:
        name, fields = json.loads(line)
        cameras[name].order(fields)
    return 0


if __name__ == "__main__":
    try:
        status = main(int(sys.argv[1]))
    except BrokenPipeError:  # the parent ended before it read our port
        status = 0
    os._exit(status)  # threads that wait for slow clients must not hold the process
