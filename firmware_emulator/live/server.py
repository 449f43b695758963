"""Runs the laboratory by the host's clock and puts every channel on a port of its own."""

import gc
import os
import selectors
import stat
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress

from drivers.laboratory import Address, CanFrame, encode_announcement
from firmware_emulator.config import LaboratoryConfig
from firmware_emulator.laboratory import (
    OVERHEAD,
    VALVE_BUS,
    EmulatedLaboratory,
    camera_seed,
    overhead_order,
    sky_seed,
)
from firmware_emulator.live.cameras import CameraProcess
from firmware_emulator.live.pty_port import PtyPort
from firmware_emulator.live.slcan import SlcanSession, encode_frame
from firmware_emulator.live.tcp_server import Client, TcpServer

NS_PER_S = 1_000_000_000
_LONGEST_WAIT_S = 0.25  # a signal that comes just before the wait is noticed after it


class LiveLaboratory:
    """The laboratory on ports: ptys for IMU blocks, slcan for the bus, TCP for poses, HTTP for pictures.

    Laboratory time is the host's monotonic clock. One thread does everything but draw.

    Args:
        config: The rig's `[laboratory]` table.
        seed: As of `EmulatedLaboratory`.

    Raises:
        pydantic.ValidationError: The table is not a scenario.
        SceneError: A file of a camera cannot be read.
    """

    def __init__(self, config: Mapping[str, object], seed: int) -> None:
        self._stack = ExitStack()
        # Not epoll, which waits in whole milliseconds: bytes are due to the tenth.
        self._selector = self._stack.enter_context(selectors.SelectSelector())
        self._sinks: dict[str, Callable[[bytes], None]] = {}
        self._sessions: dict[Client, SlcanSession] = {}
        self._ptys: dict[str, PtyPort] = {}
        self._is_stopping = False
        self.addresses: dict[str, Address] = {}
        scenario = LaboratoryConfig.model_validate(dict(config))
        try:
            self._cameras = self._start_cameras(scenario, seed)
            # Switched on last: a second spent starting the cameras would come as a burst of bytes.
            start_ns = time.monotonic_ns()
            self._laboratory = EmulatedLaboratory(config, seed, start_ns=start_ns, is_rendering=False)
            self._bus = TcpServer(self._selector, self._from_bus_client, self._forget)
            self._stack.callback(self._bus.close)
            self.addresses[VALVE_BUS] = {
                "interface": "slcan",
                "channel": self._bus.url,
                "bitrate": round(scenario.bus_bitrate),
            }
            for channel in self._laboratory.channels():
                self._open(channel)
        except BaseException:
            self._stack.close()
            raise

    def announcement(self) -> str:
        """The line that says where the channels are."""
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
        gc.collect()
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
            if isinstance(arrival.data, CanFrame):
                line = encode_frame(arrival.data)
                for client in [client for client, session in self._sessions.items() if session.is_open]:
                    self._bus.send(client, line)
            elif isinstance(arrival.data, bytes):
                self._sinks[arrival.channel](arrival.data)
        for name, exposure in self._laboratory.take_exposures():
            if self._cameras:
                self._cameras.order(name, exposure)

    def counters(self) -> dict[str, int]:
        """What was lost on the way to clients that did not read, by channel; and the camera process' woes."""
        lost = {channel: pty.dropped_bytes for channel, pty in self._ptys.items()}
        if self._cameras:
            lost["pictures"] = self._cameras.dropped_orders
            lost["camera_restarts"] = self._cameras.restarts
        return lost

    def close(self) -> None:
        """Give every port and process back; may be called twice."""
        self._stack.close()

    def _start_cameras(self, config: LaboratoryConfig, seed: int) -> CameraProcess | None:
        rows: list[dict[str, object]] = [
            {
                "name": vehicle.name,
                "ceiling": config.path(vehicle.camera.ceiling),
                "camera": config.path(vehicle.camera.camera),
                "exposure_s": vehicle.camera.exposure_s,
                "readout_s": vehicle.camera.readout_s,
                "jpeg_quality": vehicle.camera.jpeg_quality,
                "sky_seed": sky_seed(config, seed),
                "camera_seed": camera_seed(config, seed, index),
            }
            for index, vehicle in enumerate(config.vehicles)
            if vehicle.camera.source == "rendered"
        ]
        table = overhead_order(config, seed)
        if config.overhead and table:
            rows.append({"name": OVERHEAD, "table": table, "jpeg_quality": config.overhead.jpeg_quality})
        if not rows:
            return None
        cameras = CameraProcess(rows)
        self._stack.callback(cameras.close)
        for vehicle in config.vehicles:
            if vehicle.camera.source == "rendered":
                url = cameras.url(vehicle.name, vehicle.camera.stream)
                self.addresses[f"{vehicle.name}/star_camera"] = url
        if config.overhead:
            self.addresses[OVERHEAD] = cameras.url(OVERHEAD, config.overhead.stream)
        return cameras

    def _open(self, channel: str) -> None:
        if channel in self.addresses:
            return
        if channel.endswith("/imu"):
            pty = self._ptys[channel] = PtyPort()
            self._stack.callback(pty.close)
            self._selector.register(pty, selectors.EVENT_READ, lambda: self._deliver(channel, pty.read()))
            self._sinks[channel], self.addresses[channel] = pty.write, pty.path
            return
        server = TcpServer(self._selector)
        self._stack.callback(server.close)
        self._sinks[channel], self.addresses[channel] = server.broadcast, server.url

    def _deliver(self, channel: str, data: bytes) -> None:
        if data:
            self._laboratory.deliver(time.monotonic_ns(), channel, data)

    def _from_bus_client(self, client: Client, data: bytes) -> None:
        session = self._sessions.setdefault(client, SlcanSession())
        frames, answers = session.feed(data)
        for frame in frames:
            self._laboratory.deliver(time.monotonic_ns(), VALVE_BUS, frame)
            line = encode_frame(frame)
            for other in [c for c, s in self._sessions.items() if s.is_open and c is not client]:
                self._bus.send(other, line)
        self._bus.send(client, answers)

    def _forget(self, client: Client) -> None:
        self._sessions.pop(client, None)

    def _from_parent(self) -> None:
        if not os.read(sys.stdin.fileno(), 4096):
            self.stop()
