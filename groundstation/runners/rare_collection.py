"""The garbage collector during a flight in virtual time."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_YOUNG, _MIDDLE, _OLD = 50_000, 20, 50


@contextmanager
def rare_collection() -> Iterator[None]:
    """Let the collector look seldom, and never at what was there before.

    A flight makes thousands of objects a second and hardly a cycle, so nearly everything goes by its count of
    references; looking for cycles as often as Python does takes a thirtieth of the time.
    """
    before = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(_YOUNG, _MIDDLE, _OLD)
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.unfreeze()
