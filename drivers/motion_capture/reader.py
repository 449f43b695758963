"""The process that holds the library `motioncapture`: its frames as lines on stdout (`reader_lines`).

A process of its own, because the library waits for a system that does not answer without an end and without
releasing the interpreter (measured with 1.1: every thread stands still, signal handlers too), prints on
stdout, and reads packets without checking their lengths.
"""

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Mapping
from typing import Any, NoReturn

from drivers.motion_capture.reader_lines import Failed, Frame, Ready, encode


def main(config: Mapping[str, str], connect_s: float) -> int:
    """Read until stdin ends.

    Args:
        config: `system` and what the library's `connect` takes for it.
        connect_s: The process is killed if the system has not answered by then.
    """
    out = os.dup(1)
    os.dup2(2, 1)  # what the library prints
    arguments = dict(config)
    system = arguments.pop("system")
    try:
        import motioncapture
    except ImportError as error:
        return _fail(out, f"the library motioncapture cannot be loaded ({error}): install the extra mocap")
    if hasattr(signal, "setitimer"):
        # The default action is the kernel's: it works while the library holds the interpreter.
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, connect_s)
    try:
        source = motioncapture.connect(system, arguments)
    except (
        RuntimeError,
        ValueError,
    ) as error:  # what the library throws; ValueError: a port that is no number
        return _fail(out, f"{error}")
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    threading.Thread(target=_end_with_stdin, daemon=True).start()
    os.write(out, encode(Ready()))
    try:
        _read(source, out, system)
    except BrokenPipeError:  # the parent is gone
        return 0
    except RuntimeError as error:
        return _fail(out, f"{error}")


def _read(source: Any, out: int, system: str) -> NoReturn:  # noqa: ANN401 - the library has no types
    while True:
        source.waitForNextFrame()
        stamp_ns = time.monotonic_ns()
        bodies = {}
        for name, body in source.rigidBodies.items():
            x, y, z = map(float, body.position)
            turn = body.rotation
            bodies[name] = (x, y, z, turn.x, turn.y, turn.z, turn.w)
        if bodies or system != "vrpn":  # VRPN is polled and knows no frames: nothing is no news
            os.write(out, encode(Frame(stamp_ns, bodies)))


def _fail(out: int, reason: str) -> int:
    os.write(out, encode(Failed(reason)))
    return 1


def _end_with_stdin() -> None:
    sys.stdin.buffer.read()
    os._exit(0)


if __name__ == "__main__":
    os._exit(main(json.loads(sys.argv[1]), float(sys.argv[2])))
