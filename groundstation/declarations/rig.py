"""What a rig is, before any part has added its keys: the table, vehicles, their types, nodes, the laboratory.

Parts add their own keys by sections (``part.py``); ``groundstation.rig`` composes them and reads the file. A
part gets at its keys by the class of its section: ``rig.vehicle("alpha", ImuOfVehicle).imu``.

Unknown keys are refused. Lengths are metres, angles in rig files are degrees (``_deg``); relative paths are
relative to the rig file.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypeVar

import numpy as np
from pydantic import ConfigDict, Field, PrivateAttr, model_validator

from drivers.errors import Refused
from drivers.socket_url import check_socket_url
from groundstation.control.keep_in import KeepIn, rectangle
from groundstation.control.surroundings import Obstacle
from groundstation.declarations.names import PATTERN
from groundstation.declarations.rig_file import RigFile
from groundstation.declarations.section import Delay, Positive, Section, Sigma, Words
from groundstation.declarations.vehicle_type import VehicleType
from groundstation.files.errors import FileError
from groundstation.files.plain_model import PlainModel
from groundstation.fusion.levelling import levelling
from groundstation.fusion.slope_grid import SlopeGrid, slope_grid
from groundstation.fusion.table_map import TableMap

if TYPE_CHECKING:
    from groundstation.declarations.tables import Tables

LABORATORY = "laboratory:"
"""Addresses that begin so are resolved by what the emulated laboratory announces."""
STATION_CHANNEL = "station:"
"""Addresses that begin so are the launcher's to resolve; there are none in virtual time."""
MOCK_UP_RADIUS_M = 0.2  # a mock-up keeps this far from the edge of the table

VehicleName = Annotated[str, Field(pattern=f"^{PATTERN}$")]

S = TypeVar("S", bound=Section)


class KeepOutSection(Section):
    """A round place of the table that mock-ups keep out of: a lamp, a tripod, a hole."""

    name: VehicleName
    x_m: float
    y_m: float
    radius_m: Positive

    def obstacle(self) -> Obstacle:
        """The place as the safety filter knows it."""
        return Obstacle(self.name, (self.x_m, self.y_m), self.radius_m)


class TableSection(Section):
    """The table: its edges in table coordinates, what stands on it, and what is known of how it pulls.

    ``map`` is the result of ``calibrate table-map``: filter and controller feed it forward. ``legs`` say
    where the legs stand, for advice on levelling. The sigmas say how far from level and flat a table without
    a map may be; what is left out is the filter's own.
    """

    x_min_m: float
    x_max_m: float
    y_min_m: float
    y_max_m: float
    keep_out: tuple[KeepOutSection, ...] = ()
    map: RigFile | None = None
    legs: dict[str, tuple[float, float]] = Field(default_factory=dict)
    slope_sigma_m_s2: Sigma | None = None
    waviness_sigma_m_s2: Sigma | None = None
    waviness_length_m: Positive | None = None

    @model_validator(mode="after")
    def _stands(self) -> Self:
        if self.legs:
            try:
                levelling((0.0, 0.0), np.eye(2), self.legs)
            except ValueError as error:
                raise ValueError(f"legs: {error}") from error
        return self

    @model_validator(mode="after")
    def _named_apart(self) -> Self:
        names = [section.name for section in self.keep_out]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"keep_out: two places are called {name!r}")
        return self

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for axis, low, high in (("x", self.x_min_m, self.x_max_m), ("y", self.y_min_m, self.y_max_m)):
            if high - low <= 2 * MOCK_UP_RADIUS_M:
                raise ValueError(
                    f"{axis}_min_m = {low:g} and {axis}_max_m = {high:g} leave no room for a mock-up"
                )
        return self

    def slope_grid(self) -> SlopeGrid | None:
        """The table's map as filter and controller read it, None if the rig names none.

        Raises:
            ValueError: The map's file is wrong.
        """
        if self.map is None:
            return None
        try:
            return slope_grid(self.map.value(TableMap.parse))
        except FileError as error:
            raise ValueError(f"table.map: {error}") from error

    def keep_in(self) -> KeepIn:
        """The part of the table that a mock-up's centre keeps to."""
        size_m = (self.x_max_m - self.x_min_m, self.y_max_m - self.y_min_m)
        centre_m = ((self.x_max_m + self.x_min_m) / 2, (self.y_max_m + self.y_min_m) / 2)
        return rectangle(size_m, margin_m=MOCK_UP_RADIUS_M, centre_table_m=centre_m)

    def obstacles(self) -> tuple[Obstacle, ...]:
        """What stands on the table."""
        return tuple(section.obstacle() for section in self.keep_out)

    def holds(self, x_m: float, y_m: float) -> bool:
        """Whether a mock-up at this place is on the table as a whole."""
        margin_m = MOCK_UP_RADIUS_M
        return (
            self.x_min_m + margin_m <= x_m <= self.x_max_m - margin_m
            and self.y_min_m + margin_m <= y_m <= self.y_max_m - margin_m
        )


class HoldSection(Section):
    """Where a vehicle goes once it is armed."""

    x_m: float
    y_m: float
    heading_deg: float


class VehicleSection(Section):
    """One vehicle: its type, and where it goes; parts add where its devices are opened."""

    mock_up: str
    hold: HoldSection


SplitLength = Annotated[float, Field(ge=1.0, allow_inf_nan=False)]


class RecordSection(Section):
    """Where recordings go, what is kept of the camera's images, and how long a file of a live run is.

    ``split_s``: after this long another file goes on: ``recording_1.mcap``. Left out: one file.
    """

    directory: Path = Path("recordings")
    images: Literal["off", "spots", "lossless"] = "spots"
    split_s: SplitLength | None = None


class NodeSection(Section):
    """What the rig states about one node: its process, and the time it takes (emulated conditions).

    ``busy_s``: takes one message at a time and answers after this long. ``late_s``: answers late, but
    takes every message.
    """

    process: str | None = None
    busy_s: Delay = 0.0
    late_s: Delay = 0.0

    @model_validator(mode="after")
    def _either(self) -> Self:
        if self.busy_s and self.late_s:
            raise ValueError("give either 'busy_s' or 'late_s'")
        return self


class LaboratorySection(PlainModel):
    """The emulated laboratory: an installed entry point; the other keys are its own.

    Attributes:
        name: Of the entry point.
        folder: Where its relative paths start; filled in when the rig is read.
    """

    model_config = ConfigDict(extra="allow", frozen=True)
    name: str
    folder: str = ""

    @property
    def table(self) -> dict[str, Any]:
        """What the laboratory is made from."""
        return {"folder": self.folder, **(self.model_extra or {})}


class Rig(Section):
    """A whole rig; parts' keys are added by subclasses that ``groundstation.rig`` composes.

    Attributes:
        tables: Of the parts it is composed of.
    """

    tables: ClassVar[Tables]

    name: Words
    table: TableSection
    mock_ups: dict[str, VehicleType]
    vehicles: dict[VehicleName, VehicleSection] = Field(min_length=1)
    record: RecordSection = RecordSection()
    nodes: dict[str, NodeSection] = Field(default_factory=dict)
    laboratory: LaboratorySection | None = None
    _source: object = PrivateAttr(default=None)

    @property
    def source(self) -> object:
        """What it was made from, kept by ``groundstation.rig``."""
        return self._source

    def keep_source(self, source: object) -> None:
        """Keep what it was made from; called by what reads the rig."""
        self._source = source

    def section(self, kind: type[S]) -> S:
        """The keys that a part has added to the rig itself."""
        assert isinstance(self, kind)
        return self

    def vehicle(self, name: str, kind: type[S]) -> S:
        """The keys that a part has added to a vehicle."""
        found = self.vehicles[name]
        assert isinstance(found, kind)
        return found

    def type_of(self, vehicle: str) -> VehicleType:
        """The type of a vehicle."""
        return self.mock_ups[self.vehicles[vehicle].mock_up]

    def of_type(self, vehicle: str, kind: type[S]) -> S:
        """The keys that a part has added to a vehicle's type."""
        found = self.type_of(vehicle)
        assert isinstance(found, kind)
        return found


def check_address(rig: Rig, key: str, address: str | None) -> None:
    """Refuse a ``laboratory:`` address in a rig without a laboratory, and a socket's without a port.

    Raises:
        ValueError: It begins with the key.
    """
    if address is not None and address.startswith(LABORATORY) and rig.laboratory is None:
        raise ValueError(f"{key}: {address!r} needs a [laboratory] section")
    try:
        check_socket_url(address or "")
    except Refused as error:
        raise ValueError(f"{key}: {error}") from error
