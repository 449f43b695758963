"""Runs the laboratory by the host's clock and puts every channel on a port of its own."""

import gc
import os
import selectors
import stat
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack, suppress

from drivers.laboratory import Address, encode_announcement
from firmware_emulator.device_kind import PictureOrder, named
from firmware_emulator.device_table import device_kinds, read_config
from firmware_emulator.laboratory import EmulatedLaboratory, Installed
from firmware_emulator.live.cameras import CameraProcess
from firmware_emulator.live.served import LiveChannel, Serve, Served
from firmware_emulator.scenario import Scenario

NS_PER_S = 1_000_000_000
_LONGEST_WAIT_S = 0.25  # a signal that comes just before the wait is noticed after it


class LiveLaboratory:
    """The laboratory on ports: each channel is served as its device's kind states, pictures by one process.

    Laboratory time is the host's monotonic clock. One thread does everything but draw.

    Args:
        config: The rig's `[laboratory]` table.
        seed: As of `EmulatedLaboratory`.

    Raises:
        pydantic.ValidationError: The table is not a scenario.
        SceneError: A file of a camera cannot be read.
        NotFound: A device of an installed package cannot be loaded.
    """

    def __init__(self, config: Mapping[str, object], seed: int) -> None:
        self._stack = ExitStack()
        # Not epoll, which waits in whole milliseconds: bytes are due to the tenth.
        self._selector = self._stack.enter_context(selectors.SelectSelector())
        self._served: dict[str, Served] = {}
        self._is_stopping = False
        self.addresses: dict[str, Address] = {}
        scenario = Scenario(read_config(config), seed)
        try:
            self._cameras = self._start_cameras(scenario)
            # Switched on last: a second spent starting the cameras, or here, would come as a burst of bytes,
            # too many for a port that nobody reads yet.
            gc.collect()
            start_ns = time.monotonic_ns()
            self._laboratory = EmulatedLaboratory(config, seed, start_ns=start_ns, is_rendering=False)
            for row in self._laboratory.installed:
                self._open(row, scenario)
        except BaseException:
            self._stack.close()
            raise

    def announcement(self) -> str:
        """The line that states where the channels are."""
        return encode_announcement(self.addresses)

    def stop(self) -> None:
        """Let `run` end soon; may be called from a signal handler."""
        self._is_stopping = True

    def watch_parent(self) -> None:
        """End when stdin does, if it is a pipe: then somebody started us and is gone."""
        with suppress(OSError, ValueError):  # no stdin at all
            descriptor = sys.stdin.fileno()
            mode = os.fstat(descriptor).st_mode
            if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode):
                self._selector.register(descriptor, selectors.EVENT_READ, self._from_parent)

    def run(self) -> None:
        """Serve until stopped."""
        laboratory, selector = self._laboratory, self._selector
        gc.freeze()  # what lives for ever need not be looked at again, which costs milliseconds
        try:
            while not self._is_stopping:
                self.step()
                next_ns = laboratory.next_arrival_ns() or 0
                wait_s = min(_LONGEST_WAIT_S, max(0, next_ns - time.monotonic_ns()) / NS_PER_S)
                for key, _ in selector.select(wait_s):
                    key.data()
        finally:
            gc.unfreeze()

    def step(self) -> None:
        """Bring the laboratory to now and hand out what has arrived."""
        for arrival in self._laboratory.advance(time.monotonic_ns()):
            self._served[arrival.channel].send(arrival.data)
        for name, exposure in self._laboratory.take_exposures():
            if self._cameras:
                self._cameras.order(name, exposure)

    def counters(self) -> dict[str, int]:
        """What was lost on the way to clients that did not read, by channel; and the camera process' woes."""
        lost = {channel: served.lost for channel, served in self._served.items()}
        if self._cameras:
            lost["pictures"] = self._cameras.dropped_orders
            lost["camera_restarts"] = self._cameras.restarts
        return lost

    def close(self) -> None:
        """Give every port and process back; may be called twice."""
        self._stack.close()

    def _start_cameras(self, scenario: Scenario) -> CameraProcess | None:
        vehicles = range(len(scenario.config.vehicles))
        orders = [
            order
            for kind in device_kinds()
            for index in ([0] if kind.is_shared else vehicles)
            if (order := kind.order(scenario, index)) is not None
        ]
        if not orders:
            return None
        cameras = CameraProcess(orders)
        self._stack.callback(cameras.close)
        return cameras

    def _open(self, row: Installed, scenario: Scenario) -> None:
        if row.order is not None:
            self.addresses[row.channel] = self._address_of_pictures(row.order)
            return
        serve: Serve = named(row.kind.served_by)
        laboratory, channel = self._laboratory, row.channel
        served = self._served[channel] = serve(
            LiveChannel(
                channel,
                self._selector,
                scenario.config,
                row.settings,
                lambda data: laboratory.deliver(time.monotonic_ns(), channel, data),
            )
        )
        self._stack.callback(served.close)
        self.addresses[channel] = served.address

    def _address_of_pictures(self, order: PictureOrder) -> Address:
        if self._cameras is None:
            raise RuntimeError(f"camera {order.name!r} takes pictures that nobody draws")
        return self._cameras.url(order.name, order.stream)

    def _from_parent(self) -> None:
        if not os.read(sys.stdin.fileno(), 4096):
            self.stop()
