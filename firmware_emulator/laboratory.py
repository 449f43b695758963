"""The whole emulated laboratory in virtual time: every mock-up, the table and the bus, deterministic by seed.

Devices are small state machines that say when they next do something; the laboratory runs them in the order
of those moments, and vehicles move just as far as somebody looks or pushes.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, TypedDict

import numpy as np

from drivers.laboratory import Arrival, CameraFrame, CanFrame, ChannelKind
from firmware_emulator.config import LaboratoryConfig
from firmware_emulator.devices.overhead_camera import OverheadCamera, TableExposure
from firmware_emulator.devices.sky_renderer import SkyRenderer
from firmware_emulator.devices.star_camera import Exposure, Renderer
from firmware_emulator.devices.table_renderer import TableRenderer
from firmware_emulator.devices.valve_bus import ValveBus
from firmware_emulator.failures import Failures
from firmware_emulator.mock_up import MockUp, Random, build_mock_up
from firmware_emulator.plant.air_table import FloorPulses, Surface
from firmware_emulator.plant.contacts import Contacts
from firmware_emulator.sky.sky_camera import Shutter

VALVE_BUS = "valve_bus"
OVERHEAD = "overhead_camera"
_TABLE_STREAM = 0  # spawn keys of the random streams: the table, then vehicles from 1
_OVERHEAD_PART = 1  # of the table's stream
_PARTS = ("crystal", "valves", "node", "imu errors", "imu noise", "line", "housekeeping", "camera")


class _Device(Protocol):
    """Something that acts at moments of its own."""

    @property
    def next_ns(self) -> int: ...

    def run(self, now_ns: int) -> None: ...


class EmulatedLaboratory:
    """A laboratory for a lockstep runner (`drivers.laboratory.Laboratory`), and the heart of the live one.

    Args:
        config: The rig's `[laboratory]` table.
        seed: Decides every random number, together with `seed` of the table.
        start_ns: Laboratory time at which everything is switched on.
        is_rendering: False leaves pictures to whoever calls `take_exposures`.

    Raises:
        pydantic.ValidationError: The table is not a scenario.
        SceneError: A star list or camera file of a rendered camera cannot be read.
    """

    def __init__(
        self,
        config: Mapping[str, object],
        seed: int = 0,
        *,
        start_ns: int = 0,
        is_rendering: bool = True,
    ) -> None:
        self.config = LaboratoryConfig.model_validate(dict(config))
        self._seed = seed
        table = self.config.table
        rng = np.random.default_rng(self._seeds(_TABLE_STREAM, 0, 0))
        surface = Surface(table.tilt_rad, table.waviness_rad, table.waviness_length_m, rng)
        floor = FloorPulses(table.floor_pulse_rate_hz, table.floor_pulse_m_s2, table.floor_pulse_s, rng)
        self.mock_ups: tuple[MockUp, ...] = tuple(
            build_mock_up(
                index,
                vehicle,
                table,
                surface,
                floor,
                Failures.of_vehicle(self.config.failures, vehicle.name),
                self._random(index),
                start_ns,
            )
            for index, vehicle in enumerate(self.config.vehicles)
        )
        self._renderers = self._build_renderers() if is_rendering else {}
        self._overhead = self._build_overhead(start_ns)
        self._table_renderer = self._build_table_renderer() if is_rendering else None
        self._bus = ValveBus([mock_up.node for mock_up in self.mock_ups], self.config.bus_bitrate)
        self._contacts = Contacts(table.bounds_m, table.edge_restitution, table.contact_restitution)
        self._contact_ns = start_ns
        self._now_ns = start_ns
        self._devices, self._run_device = self._wire()
        self._due_ns = [device.next_ns for device in self._devices]
        self._nodes_at = [
            row for row, device in enumerate(self._devices) if any(device is m.node for m in self.mock_ups)
        ]

    def channels(self) -> Mapping[str, ChannelKind]:
        """Every channel: `valve_bus`, `overhead_camera`; per vehicle `imu` and what else it has."""
        channels = {VALVE_BUS: ChannelKind.CAN}
        if self._overhead:
            channels[OVERHEAD] = ChannelKind.CAMERA
        for mock_up in self.mock_ups:
            channels[f"{mock_up.name}/imu"] = ChannelKind.BYTES
            if mock_up.camera:
                channels[f"{mock_up.name}/star_camera"] = ChannelKind.CAMERA
            if mock_up.fixes:
                channels[f"{mock_up.name}/fixes"] = ChannelKind.BYTES
            if mock_up.truth:
                channels[f"{mock_up.name}/reference"] = ChannelKind.BYTES
        return channels

    def next_arrival_ns(self) -> int | None:
        """Earliest stamp at which something may reach the host if nothing is sent in."""
        next_ns = self._bus.next_output_ns
        if self._overhead:
            next_ns = min(next_ns, self._overhead.next_output_ns)
        for mock_up in self.mock_ups:
            next_ns = min(next_ns, mock_up.imu.next_output_ns)
            for device in (mock_up.camera, mock_up.fixes, mock_up.truth):
                if device is not None:
                    next_ns = min(next_ns, device.next_output_ns)
        return max(next_ns, self._now_ns)

    def advance(self, stamp_ns: int) -> Sequence[Arrival]:
        """Run up to `stamp_ns` and hand over all that reached the host since, that stamp included."""
        due_ns = self._due_ns
        while (now_ns := min(due_ns)) <= stamp_ns:
            row = due_ns.index(now_ns)
            self._run_device[row](now_ns)
            due_ns[row] = self._devices[row].next_ns
        self._now_ns = max(self._now_ns, stamp_ns)
        arrivals = [Arrival(stamp, VALVE_BUS, frame) for stamp, frame in self._bus.take(stamp_ns)]
        for mock_up in self.mock_ups:
            self._collect(mock_up, stamp_ns, arrivals)
        if self._overhead and self._table_renderer:
            for arrival_ns, exposure in self._overhead.take(stamp_ns):
                frame = CameraFrame(self._table_renderer.render(exposure), arrival_ns, exposure.sequence)
                arrivals.append(Arrival(arrival_ns, OVERHEAD, frame))
        arrivals.sort(key=_stamp)  # stable: equal stamps keep the order of devices
        return arrivals

    def deliver(self, stamp_ns: int, channel: str, data: bytes | CanFrame) -> None:
        """Send something into a channel at `stamp_ns`, which is not before the last `advance`.

        Raises:
            ValueError: No such channel, nothing can be sent into it, or the stamp lies in the past.
        """
        if stamp_ns < self._now_ns:
            raise ValueError(f"cannot deliver at {stamp_ns} ns: the laboratory is at {self._now_ns} ns")
        if channel == VALVE_BUS and isinstance(data, CanFrame):
            self._bus.send(stamp_ns, data)
            for row in self._nodes_at:
                self._due_ns[row] = self._devices[row].next_ns
            return
        for mock_up in self.mock_ups:
            if channel == f"{mock_up.name}/imu" and isinstance(data, bytes):
                mock_up.imu.receive(stamp_ns, data)
                row = self._devices.index(mock_up.imu)
                self._due_ns[row] = mock_up.imu.next_ns
                return
        raise ValueError(f"nothing of type {type(data).__name__} can be sent into channel {channel!r}")

    def take_exposures(self) -> list[tuple[str, Exposure | TableExposure]]:
        """With `is_rendering` False: exposures whose pictures are to be drawn.

        Returns:
            The vehicle's name, or `overhead_camera`, with each.
        """
        taken: list[tuple[str, Exposure | TableExposure]] = [
            (mock_up.name, exposure)
            for mock_up in self.mock_ups
            if mock_up.camera
            for exposure in mock_up.camera.take_exposed()
        ]
        if self._overhead:
            taken += [(OVERHEAD, exposure) for exposure in self._overhead.take_exposed()]
        return taken

    def close(self) -> None:
        """Nothing to release: everything is in memory."""

    def _seeds(self, stream: int, offset: int, part: int) -> np.random.SeedSequence:
        return np.random.SeedSequence([self._seed, self.config.seed], spawn_key=(stream, offset, part))

    def _random(self, index: int) -> Random:
        offset = self.config.vehicles[index].seed_offset
        return lambda part: np.random.default_rng(self._seeds(1 + index, offset, _PARTS.index(part)))

    def _build_renderers(self) -> dict[str, Renderer]:
        renderers: dict[str, Renderer] = {}
        for index, vehicle in enumerate(self.config.vehicles):
            camera = vehicle.camera
            if camera.source == "rendered":
                renderers[vehicle.name] = SkyRenderer.load(
                    self.config.path(camera.ceiling),
                    self.config.path(camera.camera),
                    Shutter(camera.exposure_s, camera.readout_s),
                    sky_seed(self.config, self._seed),
                    camera_seed(self.config, self._seed, index),
                )
        return renderers

    def _build_overhead(self, start_ns: int) -> OverheadCamera | None:
        config = self.config.overhead
        if config is None:
            return None
        return OverheadCamera(
            {mock_up.name: mock_up.vehicle for mock_up in self.mock_ups},
            config.rate_hz,
            config.exposure_s,
            config.delay_s,
            config.delay_jitter_s,
            {m.name: Failures.of_vehicle(self.config.failures, m.name) for m in self.mock_ups},
            np.random.default_rng(self._seeds(_TABLE_STREAM, 0, _OVERHEAD_PART)),
            start_ns,
        )

    def _build_table_renderer(self) -> TableRenderer | None:
        order = overhead_order(self.config, self._seed)
        return None if order is None else TableRenderer.load(**order)

    def _wire(self) -> tuple[list[_Device], list[Callable[[int], None]]]:
        """All devices, and how each is run."""
        devices: list[_Device] = [_ContactWatch(self)]
        runs: list[Callable[[int], None]] = [devices[0].run]
        for mock_up in self.mock_ups:
            # Nodes come first: at equal stamps a valve moves before somebody looks.
            devices.append(mock_up.node)
            runs.append(self._run_node(mock_up))
            for device in (mock_up.imu, mock_up.camera, mock_up.fixes, mock_up.truth):
                if device is not None:
                    devices.append(device)
                    runs.append(device.run)
        if self._overhead:
            devices.append(self._overhead)
            runs.append(self._overhead.run)
        return devices, runs

    def _run_node(self, mock_up: MockUp) -> Callable[[int], None]:
        node, bus = mock_up.node, self._bus

        def run(now_ns: int) -> None:
            node.run(now_ns)
            if node.outbox:
                bus.collect(node, now_ns)

        return run

    def resolve_contacts(self, now_ns: int) -> int:
        """Bring all vehicles to `now_ns`, push apart what touches; return when to look again."""
        vehicles = [mock_up.vehicle for mock_up in self.mock_ups]
        for vehicle in vehicles:
            vehicle.advance(now_ns)
        return self._contacts.resolve(vehicles)

    def _collect(self, mock_up: MockUp, until_ns: int, arrivals: list[Arrival]) -> None:
        name = mock_up.name
        arrivals += [Arrival(stamp, f"{name}/imu", data) for stamp, data in mock_up.imu.line.take(until_ns)]
        if mock_up.truth:
            arrivals += [Arrival(s, f"{name}/reference", data) for s, data in mock_up.truth.take(until_ns)]
        if mock_up.fixes:
            arrivals += [Arrival(s, f"{name}/fixes", data) for s, data in mock_up.fixes.take(until_ns)]
        if mock_up.camera and name in self._renderers:
            for stamp_ns, exposure in mock_up.camera.take(until_ns):
                image = self._renderers[name].render(exposure)
                frame = CameraFrame(image, stamp_ns, exposure.sequence)
                arrivals.append(Arrival(stamp_ns, f"{name}/star_camera", frame))


class _ContactWatch:
    """Looks for contacts as often as they can happen."""

    def __init__(self, laboratory: EmulatedLaboratory) -> None:
        self._laboratory = laboratory
        self.next_ns = laboratory.resolve_contacts(laboratory.mock_ups[0].vehicle.now_ns)

    def run(self, now_ns: int) -> None:
        self.next_ns = self._laboratory.resolve_contacts(now_ns)


def sky_seed(config: LaboratoryConfig, seed: int) -> list[int]:
    """Seed of the sky, which all cameras share, for whoever draws it."""
    return [seed, config.seed]


def camera_seed(config: LaboratoryConfig, seed: int, index: int) -> list[int]:
    """Seed of the noise of vehicle `index`'s camera, for whoever draws its pictures."""
    return [seed, config.seed, 1 + index, config.vehicles[index].seed_offset]


class OverheadOrder(TypedDict):
    """What `TableRenderer.load` takes; plain enough for a line of JSON."""

    camera: str
    circles: str
    bounds_m: list[float]
    radii_m: dict[str, float]
    seed: list[int]


def overhead_order(config: LaboratoryConfig, seed: int) -> OverheadOrder | None:
    """What whoever draws the table needs; None without a camera over it."""
    if config.overhead is None:
        return None
    return OverheadOrder(
        camera=config.path(config.overhead.camera),
        circles=config.path(config.overhead.circles),
        bounds_m=list(config.table.bounds_m),
        radii_m={vehicle.name: vehicle.radius_m for vehicle in config.vehicles},
        seed=[seed, config.seed, len(config.vehicles) + 1],
    )


def _stamp(arrival: Arrival) -> int:
    return arrival.stamp_ns
