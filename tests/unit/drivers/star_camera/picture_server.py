"""A server of pictures by HTTP that sends what a test scripts, byte by byte."""

import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np

PATIENCE_S = 20.0  # only a failing test waits so long


def picture(value):
    return np.full((24, 32), value, np.uint8)


def raw_part(image, number, *headers):
    head = (
        "--frame\r\nContent-Type: application/x-mono8\r\n"
        f"X-Width: {image.shape[1]}\r\nX-Height: {image.shape[0]}\r\nX-Sequence: {number}\r\n"
        + "".join(f"{header}\r\n" for header in headers)
        + f"Content-Length: {image.size}\r\n\r\n"
    )
    return head.encode() + image.tobytes() + b"\r\n"


def jpeg_part(body):
    return b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(body) + body + b"\r\n"


class Script:
    """What the server sends, in order; an Event in it makes the server wait."""

    def __init__(self, *steps, content_type="multipart/x-mixed-replace; boundary=frame", status=200):
        self.steps, self.content_type, self.status = steps, content_type, status
        self.over = threading.Event()


@contextmanager
def serve(script):
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(script.status)
            self.send_header("Content-Type", script.content_type)
            self.end_headers()
            for step in script.steps:
                if isinstance(step, threading.Event):
                    step.wait(PATIENCE_S)
                else:
                    self.wfile.write(step)
            self.close_connection = True

        def log_message(self, *args):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = False
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/alpha.raw"
    finally:
        script.over.set()
        for step in script.steps:
            if isinstance(step, threading.Event):
                step.set()
        server.shutdown()
        server.server_close()
        thread.join()
