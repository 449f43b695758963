"""The whole emulated laboratory in virtual time: mock-ups, table, devices, deterministic by seed.

Devices are small state machines that say when they next do something; the laboratory runs them in the order
of those moments, and vehicles move just as far as somebody looks or pushes. Which devices there are is the
business of the table of devices and of the scenario.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, product
from typing import Any

from drivers.laboratory import Arrival, CameraFrame, ChannelKind
from firmware_emulator.device_kind import Camera, Device, DeviceKind, PictureOrder, Receiver, Renderer, Runner
from firmware_emulator.device_table import device_kinds, failure_kinds, read_config
from firmware_emulator.mock_up import build_mock_ups, build_table
from firmware_emulator.plant.contacts import Contacts, ContactWatch
from firmware_emulator.scenario import MockUp, Scenario, Site


@dataclass(frozen=True, slots=True)
class Installed:
    """A device that stands in the laboratory.

    Attributes:
        kind: Its row of the table.
        channel: Where what it sends arrives.
        device: The thing itself.
        receiver: The thing again if something can be sent into its channel.
        settings: What it was built from.
        order: Who draws its pictures, if it is a camera.
        renderer: Draws them here; None if nobody does, or somebody else.
    """

    kind: DeviceKind[Any]
    channel: str
    device: Device
    receiver: Receiver | None
    settings: Any
    order: PictureOrder | None
    renderer: Renderer | None


class EmulatedLaboratory:
    """A laboratory for a lockstep runner (`drivers.laboratory.Laboratory`), and the heart of the live one.

    Args:
        config: The rig's `[laboratory]` table.
        seed: Decides every random number, together with `seed` of the table.
        start_ns: Laboratory time at which everything is switched on.
        is_rendering: False leaves pictures to whoever calls `take_exposures`.

    Attributes:
        config: The `[laboratory]` table as read.
        surface: The truth about the table's slope.
        mock_ups: The vehicles on the table.
        installed: Their devices and those that they share, in the order in which arrivals of one stamp come.

    Raises:
        pydantic.ValidationError: The table is not a scenario.
        SceneError: A star list or camera file of a rendered camera cannot be read.
        NotFound: A device of an installed package cannot be loaded.
        TypeError: Something can be sent to a kind of device that has no method `receive`.
    """

    def __init__(
        self,
        config: Mapping[str, object],
        seed: int = 0,
        *,
        start_ns: int = 0,
        is_rendering: bool = True,
    ) -> None:
        scenario = Scenario(read_config(config), seed, start_ns)
        self.config = scenario.config
        self.surface, floor = build_table(scenario)
        self.mock_ups: tuple[MockUp, ...] = build_mock_ups(scenario, self.surface, floor)
        site = Site(scenario, self.mock_ups, failure_kinds(device_kinds()))
        self.installed = tuple(_install(site, is_rendering))
        self._places = {row.channel: place for place, row in enumerate(self.installed)}
        self._now_ns = start_ns
        table = scenario.config.table
        contacts = ContactWatch(
            [mock_up.vehicle for mock_up in self.mock_ups],
            Contacts(table.bounds_m, table.edge_restitution, table.contact_restitution),
        )
        self._runners: tuple[Runner, ...] = (contacts, *(row.device for row in self.installed))
        # Kept, and looked up again of a device that did something: asking all of them each time costs more.
        self._due_ns = [runner.next_ns for runner in self._runners]
        self._output_ns = [row.device.next_output_ns for row in self.installed]

    def channels(self) -> Mapping[str, ChannelKind]:
        """Every channel, by the devices that the scenario has."""
        return {row.channel: row.kind.channel for row in self.installed}

    def next_arrival_ns(self) -> int | None:
        """Earliest stamp at which something may reach the host if nothing is sent in."""
        return max(self._now_ns, min(self._output_ns))

    def advance(self, stamp_ns: int) -> Sequence[Arrival]:
        """Run up to `stamp_ns` and hand over all that reached the host since, that stamp included."""
        due_ns, output_ns = self._due_ns, self._output_ns
        while (now_ns := min(due_ns)) <= stamp_ns:
            row = due_ns.index(now_ns)
            self._runners[row].run(now_ns)
            due_ns[row] = self._runners[row].next_ns
            if row:  # contacts send nothing
                output_ns[row - 1] = self.installed[row - 1].device.next_output_ns
        self._now_ns = max(self._now_ns, stamp_ns)
        arrivals: list[Arrival] = []
        for place, may_arrive_ns in enumerate(output_ns):
            if may_arrive_ns <= stamp_ns:
                _collect(self.installed[place], stamp_ns, arrivals)
                output_ns[place] = self.installed[place].device.next_output_ns
        arrivals.sort(key=_stamp)  # stable: equal stamps keep the order of devices
        return arrivals

    def deliver(self, stamp_ns: int, channel: str, data: object) -> None:
        """Send something into a channel at `stamp_ns`, which is not before the last `advance`.

        Raises:
            ValueError: No such channel, nothing can be sent into it, or the stamp lies in the past.
        """
        if stamp_ns < self._now_ns:
            raise ValueError(f"cannot deliver at {stamp_ns} ns: the laboratory is at {self._now_ns} ns")
        place = self._places.get(channel)
        row = None if place is None else self.installed[place]
        if (
            place is None
            or row is None
            or row.receiver is None
            or not isinstance(data, row.kind.accepts or ())
        ):
            raise ValueError(f"nothing of type {type(data).__name__} can be sent into channel {channel!r}")
        row.receiver.receive(stamp_ns, data)
        self._due_ns[1 + place], self._output_ns[place] = row.device.next_ns, row.device.next_output_ns

    def take_exposures(self) -> list[tuple[str, Any]]:
        """With `is_rendering` False: exposures to be drawn, each with the name of its camera."""
        exposures: list[tuple[str, Any]] = []
        for place, row in enumerate(self.installed):
            if row.order and isinstance(row.device, Camera):
                exposures += [(row.order.name, exposure) for exposure in row.device.take_exposed()]
                self._output_ns[place] = row.device.next_output_ns
        return exposures

    def close(self) -> None:
        """Nothing to release: everything is in memory."""


def _install(site: Site, is_rendering: bool) -> Iterator[Installed]:
    """Build every device that the scenario has; what a vehicle carries stays together."""
    scenario = site.scenario
    for is_shared, group in groupby(device_kinds(), key=lambda kind: kind.is_shared):
        kinds = list(group)
        places = [None] if is_shared else site.mock_ups
        for mock_up, kind in product(places, kinds):
            index, table = (mock_up.index, mock_up.config) if mock_up else (0, scenario.config)
            settings = kind.settings_in(table)
            device = None if settings is None else kind.build(site, mock_up, settings)
            if device is None:
                continue
            channel = f"{mock_up.name}/{kind.name}" if mock_up else kind.name
            order = kind.order(scenario, index)
            renderer = order.load() if order and is_rendering else None
            yield Installed(kind, channel, device, _receiver(kind, device), settings, order, renderer)


def _receiver(kind: DeviceKind[Any], device: Device) -> Receiver | None:
    if kind.accepts is None:
        return None
    if not isinstance(device, Receiver):
        raise TypeError(f"device kind {kind.name!r} accepts data but has no method receive")
    return device


def _collect(row: Installed, until_ns: int, arrivals: list[Arrival]) -> None:
    if row.order is None:
        arrivals += [Arrival(stamp_ns, row.channel, data) for stamp_ns, data in row.device.take(until_ns)]
    elif row.renderer is not None:
        for stamp_ns, exposure in row.device.take(until_ns):
            frame = CameraFrame(row.renderer.render(exposure), stamp_ns, exposure.sequence)
            arrivals.append(Arrival(stamp_ns, row.channel, frame))


def _stamp(arrival: Arrival) -> int:
    return arrival.stamp_ns
