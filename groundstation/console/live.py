"""The console of a flight: a process beside the rig's own, fed by the record streams."""

import asyncio
import json
import os
import time
from collections.abc import Iterable, Mapping
from typing import Any

from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import RECORD, ZenohBus
from groundstation.console.desk import Desk
from groundstation.console.events import Events
from groundstation.console.feed import Feed
from groundstation.console.flown_ahead import FlownAhead
from groundstation.console.limit_watch import LimitWatch
from groundstation.console.options import Options
from groundstation.console.rig_page import rig_page
from groundstation.console.serving import serve, server_of
from groundstation.console.shown_console import Console
from groundstation.console.tokens import Tokens
from groundstation.console.wizards import Wizards
from groundstation.declarations.errors import UsageError
from groundstation.declarations.names import CONSOLE
from groundstation.declarations.rig import Rig
from groundstation.launch.orders import Orders
from groundstation.launch.process import NICENESS, stop_when_asked
from groundstation.rig.read import parse_rig
from groundstation.scenario.loading import Scenario, made

MOST_BATCHES = 4096
ALIVE_S = 0.5
PICTURE_S = 1.0


class LiveSource:
    """A flight that goes on.

    Args:
        rig: The rig.
        bus: Session with its hub.
        scenario: That it flies; None for none.
    """

    def __init__(self, rig: Rig, bus: ZenohBus, scenario: Scenario | None = None) -> None:
        self.vehicles = tuple(rig.vehicles)
        self.feed = Feed(rig.tables.payloads)
        self.events = Events(self.feed)
        self.page: dict[str, Any] = {**rig_page(rig), "kind": "live"}
        self._limits = None if scenario is None else LimitWatch(scenario, self.feed)
        self._now_ns = 0
        self._batches = bus.collect(f"{RECORD}/*", MOST_BATCHES)

    def step(self) -> int:
        """Take the batches that have come."""
        now_ns = time.monotonic_ns()
        for _, batch in self._batches.take():
            self.feed.take_batch(batch, now_ns)
        self._now_ns = now_ns
        return now_ns

    def extra(self) -> dict[str, Any]:
        return {} if self._limits is None else {"limits": self._limits.shown(self._now_ns)}

    def control(self, asked: Mapping[str, Any]) -> None:
        raise ValueError(f"{asked.get('what')!r:.40}: time goes on by itself in a flight")

    def columns(self, names: Iterable[str]) -> None:
        del names

    def close(self) -> None:
        self.page = {}


def run(orders: Orders) -> None:
    """Serve until asked to stop; what the launcher starts.

    Raises:
        UsageError: It must not be opened so, or the port is taken.
    """
    assert orders.attendant is not None
    options = orders.attendant.options
    assert isinstance(options, Options)
    trouble = options.access.trouble()
    if trouble:
        raise UsageError(trouble)
    os.nice(NICENESS)
    rig = parse_rig(orders.rig_text, orders.rig_path, orders.files)
    with ZenohBus(orders.endpoint) as bus, ZenohBus(orders.endpoint) as stop_bus:
        asyncio.run(_serve(rig, orders, options, bus, stop_bus))


async def _serve(rig: Rig, orders: Orders, options: Options, bus: ZenohBus, stop_bus: ZenohBus) -> None:
    scenario = None
    if options.scenario is not None:
        content, path = options.scenario
        scenario = made(json.loads(content), path)
    source = LiveSource(rig, bus, scenario)
    desk = Desk(bus, stop_bus, source.vehicles, rig.tables.actions, Tokens(options.secret))
    ahead = FlownAhead(rig, source.feed, orders)
    console = Console(source, rig.tables, options.access, desk, ahead.fly if ahead.can_fly else None)
    console.lead(
        Wizards(
            rig, orders.rig_text, orders.rig_path.name, source.feed, desk, console.holder, console.hall.tell
        )
    )
    server = server_of(console)
    loop = asyncio.get_running_loop()

    def end() -> None:
        server.should_exit = True

    def stop() -> None:
        loop.call_soon_threadsafe(end)

    stop_when_asked(stop)
    tasks = [
        asyncio.create_task(_report_life(bus, orders.process)),
        asyncio.create_task(_keep_pictures(console, desk)),
    ]
    try:
        await serve(server, options.access.address, lambda: bus.announce(orders.process))
    finally:
        for task in tasks:
            task.cancel()


async def _report_life(bus: ZenohBus, process: str) -> None:
    """An empty batch is its sign of life."""
    while True:
        bus.publish_batch(process, RecordWriter().take())
        await asyncio.sleep(ALIVE_S)


async def _keep_pictures(console: Console, desk: Desk) -> None:
    """Ask for a picture of each camera that somebody looks at."""
    while True:
        for vehicle in console.hall.cameras:
            await desk.request(vehicle, "picture", {}, CONSOLE)
        await asyncio.sleep(PICTURE_S)
