"""`python -m firmware_emulator RIG.toml`: the laboratory that is not there, in real time.

Prints one JSON line that states where each channel can be opened, then serves until SIGTERM, SIGINT or, if
stdin is a pipe, its end.
"""

import os
import signal
import sys

if __name__ == "__main__":
    # Before the imports, which take half a second: whoever ends us meanwhile wants no traceback.
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda *_: os._exit(0))
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported

    from firmware_emulator.live.command_line import main

    sys.exit(main())
