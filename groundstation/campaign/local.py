"""Runs flown by processes of this machine."""

import contextlib
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process

from groundstation.campaign.flying import Package, Row, died, fly_run, unpacked

Take = Callable[[int, Row], None]
SINGLE_THREADED = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""Workers share the cores among themselves."""


def fly_here(package: Package, runs: Iterable[int], workers: int, take: Take) -> None:
    """Fly runs.

    A worker that dies is replaced, and what was being flown then is flown again, one at a time: a run that
    takes its worker with it when it is alone is given up, with a row for it.

    Args:
        package: The campaign.
        runs: Numbers of the runs.
        workers: How many processes.
        take: Called with each row, in the order in which runs end.
    """
    waiting, suspects = deque(runs), deque[int]()
    while waiting or suspects:
        if suspects:
            run = suspects.popleft()
            if _flown_until_broken(package, deque([run]), 1, take):
                take(run, died(unpacked(package)[1], package.plan, run))
        suspects += _flown_until_broken(package, waiting, workers, take) if not suspects else ()


def _flown_until_broken(package: Package, waiting: deque[int], workers: int, take: Take) -> list[int]:
    """Fly until all is flown or a worker dies; the runs that were being flown then."""
    if not waiting:
        return []
    flying: dict[Future[Row], int] = {}
    os.environ.update(SINGLE_THREADED)
    pool = ProcessPoolExecutor(
        min(workers, len(waiting)), get_context("spawn"), initializer=_begin, initargs=(package,)
    )
    try:
        while waiting or flying:
            with _quiet():
                while waiting and len(flying) < workers:
                    run = waiting.popleft()
                    flying[pool.submit(fly_run, package, run)] = run
            for future in wait(flying, return_when=FIRST_COMPLETED).done:
                row = future.result()
                take(flying.pop(future), row)
    except BrokenProcessPool:
        return _saved(flying, take)
    finally:
        if flying:
            _end(pool)
        pool.shutdown(wait=True, cancel_futures=True)
    return []


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Let processes begin with Ctrl-C held off: it is their parent's to answer, also while they import."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _saved(flying: dict[Future[Row], int], take: Take) -> list[int]:
    """Take what had ended when the pool broke; return the others."""
    lost = []
    for future, run in flying.items():
        if future.done() and future.exception() is None:
            take(run, future.result())
        else:
            lost.append(run)
    return sorted(lost)


def _end(pool: ProcessPoolExecutor) -> None:
    """Workers in the middle of a flight are not waited for."""
    for process in list((pool._processes or {}).values()):  # noqa: SLF001 - 3.14 has kill_workers for this
        with contextlib.suppress(OSError):
            process.kill()


def _begin(package: Package) -> None:
    """A worker begins; it does not outlive its parent."""
    parent = parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
    unpacked(package)
