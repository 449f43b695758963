"""Runs flown by the workers of an existing dask.distributed cluster (extra ``cluster``)."""

import logging
from collections import deque
from collections.abc import Iterable
from concurrent.futures import CancelledError
from typing import Any

from groundstation.campaign.errors import CampaignError
from groundstation.campaign.flying import Package, died, fly_run, unpacked
from groundstation.campaign.local import Take
from groundstation.recording.software import software

CONNECT_S = 10.0
AHEAD = 2
"""Runs that wait at each worker while it flies one."""


def fly_there(package: Package, runs: Iterable[int], address: str, take: Take) -> None:
    """Fly runs on a cluster; what a worker that dies was flying is flown again by another.

    Args:
        package: The campaign: it travels with each run, for workers need not share a disk.
        runs: Numbers of the runs.
        address: Of the scheduler, ``tcp://host:port``.
        take: Called with each row, in the order in which runs end.

    Raises:
        CampaignError: There is no such cluster, it has no workers, or they have another ground station;
            or it went away.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise CampaignError(
            "--scheduler needs dask.distributed: pip install 'groundstation[cluster]'"
        ) from error
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # tracebacks of what is said below
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise CampaignError(f"--scheduler {address}: no cluster answers there ({error})") from error
    try:
        with client, client.as_current():
            _fly(client, package, deque(runs), address, take)
    except (CancelledError, OSError) as error:
        raise CampaignError(
            f"--scheduler {address}: the cluster went away; --resume goes on once it is back"
        ) from error


def _fly(client: Any, package: Package, waiting: deque[int], address: str, take: Take) -> None:  # noqa: ANN401
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    width = _checked(client, address)
    flying: dict[Any, int] = {}
    ended: Any = as_completed()

    def submit() -> None:
        run = waiting.popleft()
        future = client.submit(fly_run, package, run, key=f"{package.token}-{run}", pure=False)
        flying[future] = run
        ended.add(future)

    while waiting and len(flying) < width:
        submit()
    for future in ended:
        run = flying.pop(future)
        trouble = future.exception()
        if trouble is None:
            take(run, future.result())
        elif isinstance(trouble, KilledWorker):
            take(run, died(unpacked(package)[1], package.plan, run))
        elif isinstance(trouble, CancelledError | OSError):
            raise trouble
        else:
            raise CampaignError(f"--scheduler {address}: run {run} could not be flown ({trouble})")
        future.release()
        if waiting:
            submit()


def _checked(client: Any, address: str) -> int:  # noqa: ANN401 distributed is an extra without types
    """How many runs are submitted ahead."""
    workers = client.scheduler_info(n_workers=-1)["workers"]
    if not workers:
        raise CampaignError(f"--scheduler {address}: the cluster has no workers")
    try:
        theirs = set(client.run(software).values())
    except ImportError as error:
        raise CampaignError(f"--scheduler {address}: a worker has no ground station ({error})") from error
    if theirs != {software()}:
        raise CampaignError(
            f"--scheduler {address}: workers have {', '.join(sorted(theirs))}, here it is {software()}: "
            "rows would not be the same"
        )
    return AHEAD * sum(int(worker["nthreads"]) for worker in workers.values())
