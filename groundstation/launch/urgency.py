"""Going first on a busy machine, where the system permits it: for what carries a stop.

It takes the right to real-time scheduling (root, or ``rtprio`` in ``/etc/security/limits.conf``). Without it
everything works as before, and a stop waits its turn like any other process.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager

_LOWEST = 1
"""Priority among real-time threads: before everything usual, behind whatever a laboratory has set up."""


def go_first() -> bool:
    """Let this thread, and those that it starts from now on, go first; False if it is not permitted."""
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_LOWEST))
    except OSError:
        return False
    return True


@contextmanager
def going_first() -> Iterator[bool]:
    """The same for a while: threads that are started within go first for good, the caller only meanwhile."""
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    is_permitted = go_first()
    try:
        yield is_permitted
    finally:
        if is_permitted:
            os.sched_setscheduler(0, policy, parameters)
