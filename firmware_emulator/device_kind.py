"""What a kind of device is to the laboratory: one declaration, over which laboratory and live server loop.

A package adds a device of its own by an entry point of the group `firmware_emulator.devices` that names its
`DeviceKind`.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, Generic, Literal, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from drivers.laboratory import ChannelKind
from firmware_emulator.failures import FailureKind
from firmware_emulator.scenario import MockUp, Scenario, Site
from firmware_emulator.settings import Settings

SettingsT = TypeVar("SettingsT", bound=Settings)


class Runner(Protocol):
    """A state machine that states when it next does something."""

    @property
    def next_ns(self) -> int:
        """When it next does something; `FAR_FUTURE_NS` if never."""
        ...

    def run(self, now_ns: int) -> None:
        """Do what is due at `now_ns`; then `next_ns` lies later."""
        ...


class Device(Runner, Protocol):
    """A runner with a channel to the host."""

    @property
    def next_output_ns(self) -> int:
        """Earliest stamp at which something of it may reach the host if nothing is sent in."""
        ...

    def take(self, until_ns: int) -> Sequence[tuple[int, Any]]:
        """What reached the host up to `until_ns`, with stamps; a camera returns exposures."""
        ...


@runtime_checkable
class Receiver(Protocol):
    """A device into whose channel something can be sent."""

    def receive(self, stamp_ns: int, data: Any) -> None:  # noqa: ANN401 - of the kind's type `accepts`
        """What the host sends at `stamp_ns`."""
        ...


@runtime_checkable
class Camera(Protocol):
    """A device whose exposures may be drawn by somebody else."""

    def take_exposed(self) -> Sequence[Any]:
        """Exposures taken so far, ahead of their arrival."""
        ...


class Renderer(Protocol):
    """Draws exposures; a class that is loaded by name, in the camera process too."""

    @staticmethod
    def exposure(fields: dict[str, Any]) -> Any:  # noqa: ANN401 - the renderer's own type
        """The exposure that `dataclasses.asdict` made into `fields`."""
        ...

    def render(self, exposure: Any) -> NDArray[np.uint8]:  # noqa: ANN401 - likewise
        """The picture, shape (height, width) or (height, width, 3)."""
        ...


@dataclass(frozen=True, slots=True)
class PictureOrder:
    """Who draws the pictures of a camera, and how they are served live; plain enough for a line of JSON.

    Attributes:
        name: Of the camera, in the address of its pictures.
        renderer: `module:class` with a class method `load(**arguments)` that makes a `Renderer`.
        arguments: For it.
        stream: How live pictures are served over HTTP.
        jpeg_quality: Of them.
    """

    name: str
    renderer: str
    arguments: Mapping[str, Any]
    stream: Literal["raw", "mjpeg"]
    jpeg_quality: int

    def load(self) -> Renderer:
        """Make the renderer.

        Raises:
            firmware_emulator.sky.scene.SceneError: A file is missing or wrong.
        """
        renderer: Renderer = named(self.renderer).load(**self.arguments)
        return renderer


@dataclass(frozen=True, slots=True, eq=False)
class DeviceKind(Generic[SettingsT]):
    """A row of the table of devices. Each device has one channel, named after it.

    Attributes:
        name: The channel is `<vehicle>/<name>`, or `<name>` where all vehicles share the device.
        channel: What travels on it.
        per_vehicle: Builds the device of a mock-up from its section's settings; None if it has none.
        per_laboratory: The same for one that all share.
        among_others: The same for one that a mock-up carries and that looks at the others. A kind has one of
            the three builders.
        section: Its table in `[[laboratory.vehicles]]`, or in `[laboratory]` if it is shared; empty if its
            keys stand in that table itself, which its builder then gets. Kinds may share a section.
        settings: The section's shape.
        is_standard: Whether it is there, with default settings, where the section is not.
        accepts: Type of what can be sent into the channel; None if nothing.
        pictures: Of a camera: who draws, from the vehicle's index (0 if shared) and settings.
        served_by: `module:callable` that serves the channel live (`firmware_emulator.live.served.Serve`); of
            a camera empty, since the camera process serves its pictures.
        failures: Kinds of failure that it brings, by name.
    """

    name: str
    channel: ChannelKind
    per_vehicle: Callable[[MockUp, SettingsT], Device | None] | None = None
    per_laboratory: Callable[[Site, SettingsT], Device | None] | None = None
    among_others: Callable[[Site, MockUp, SettingsT], Device | None] | None = None
    section: str = ""
    settings: type[SettingsT] | None = None
    is_standard: bool = False
    accepts: type[object] | None = None
    pictures: Callable[[Scenario, int, SettingsT], PictureOrder | None] | None = None
    served_by: str = ""
    failures: Mapping[str, FailureKind] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z][a-z0-9_]*", self.name):
            raise ValueError(f"device kind {self.name!r}: a name is lower case, as it is part of a channel's")
        builders = (self.per_vehicle, self.per_laboratory, self.among_others)
        if sum(builder is not None for builder in builders) != 1:
            raise ValueError(
                f"device kind {self.name!r} needs one builder: per_vehicle, per_laboratory or among_others"
            )
        if bool(self.section) != (self.settings is not None):
            raise ValueError(f"device kind {self.name!r} has a section without settings or the reverse")
        if bool(self.served_by) == (self.pictures is not None):
            raise ValueError(f"device kind {self.name!r} needs served_by, or pictures, and not both")

    @property
    def is_shared(self) -> bool:
        """Whether all vehicles share one."""
        return self.per_laboratory is not None

    def settings_in(self, table: Any) -> SettingsT | None:  # noqa: ANN401 - the reader gave it its sections
        """The section in a vehicle's table, or in the laboratory's if the device is shared."""
        found: SettingsT | None = getattr(table, self.section) if self.section else table
        return found

    def build(self, site: Site, mock_up: MockUp | None, settings: SettingsT) -> Device | None:
        """The device of a mock-up, or of the site if it is shared; None if there is none in this scenario."""
        if self.per_laboratory is not None:
            return self.per_laboratory(site, settings)
        if mock_up is None:
            raise ValueError(f"a device of kind {self.name!r} needs a mock-up to carry it")
        if self.among_others is not None:
            return self.among_others(site, mock_up, settings)
        assert self.per_vehicle is not None
        return self.per_vehicle(mock_up, settings)

    def order(self, scenario: Scenario, index: int = 0) -> PictureOrder | None:
        """Who draws its pictures; None if it takes none in this scenario."""
        settings = self.settings_in(scenario.config if self.is_shared else scenario.config.vehicles[index])
        if self.pictures is None or settings is None:
            return None
        return self.pictures(scenario, index, settings)


def named(path: str) -> Any:  # noqa: ANN401 - whatever stands there
    """What stands at `module:name`; loaded when it is needed, since a server may want what an OS lacks."""
    module, _, name = path.partition(":")
    return getattr(import_module(module), name)
