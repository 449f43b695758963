"""The rig file: one TOML that says what stands in the laboratory and how it is wired.

Unknown keys are refused. Lengths are metres, angles in rig files are degrees (``_deg``). Relative
paths are relative to the rig file. Addresses beginning with ``laboratory:`` are resolved by what the
emulated laboratory announces; all others are opened as they stand.
"""

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import can
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from drivers.valve_bus.messages import MAX_VEHICLES
from groundstation.files.errors import CalibrationFileError
from groundstation.fusion.levelling import levelling
from groundstation.runtime.errors import RigError
from groundstation.runtime.rig_mock_up import MockUpSection, NonNegative, Positive, Section

LABORATORY = "laboratory:"
MOCK_UP_RADIUS_M = 0.2  # a mock-up keeps this far from the edge of the table


class TableSection(Section):
    """The table: its edges in table coordinates, and what is known of how it pulls.

    ``map`` is the result of ``calibrate table-map``: filter and controller feed it forward. ``legs`` say
    where the legs stand, for advice on levelling. The sigmas say how far from level and flat a table without
    a map may be; what is left out is the filter's own.
    """

    x_min_m: float
    x_max_m: float
    y_min_m: float
    y_max_m: float
    map: Path | None = None
    legs: dict[str, tuple[float, float]] = Field(default_factory=dict)
    slope_sigma_m_s2: Positive | None = None
    waviness_sigma_m_s2: Positive | None = None
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
    def _ordered(self) -> Self:
        for axis, low, high in (("x", self.x_min_m, self.x_max_m), ("y", self.y_min_m, self.y_max_m)):
            if high - low <= 2 * MOCK_UP_RADIUS_M:
                raise ValueError(
                    f"{axis}_min_m = {low:g} and {axis}_max_m = {high:g} leave no room for a mock-up"
                )
        return self

    def holds(self, x_m: float, y_m: float) -> bool:
        """Whether a mock-up at this place is on the table as a whole."""
        margin_m = MOCK_UP_RADIUS_M
        return (
            self.x_min_m + margin_m <= x_m <= self.x_max_m - margin_m
            and self.y_min_m + margin_m <= y_m <= self.y_max_m - margin_m
        )


class OverheadCameraSection(Section):
    """The camera over the table: where it is opened, its files, its delay and the floor of its errors.

    ``circles`` says what each mock-up wears. The sigmas are what calibration of the camera and gluing of the
    circles leave in every fix, beyond the covariance that comes with it.
    """

    address: str
    camera: Path
    circles: Path
    delay_s: NonNegative = 0.0
    delay_sigma_s: NonNegative = 0.002
    timeout_s: Positive = 2.0
    sigma_xy_m: Positive = 0.001
    sigma_heading_rad: Positive = 0.003


class HoldSection(Section):
    """Where a vehicle goes once it is armed."""

    x_m: float
    y_m: float
    heading_deg: float


class VehicleSection(Section):
    """One vehicle: its type, its place on the valve bus and where its devices are opened."""

    mock_up: str
    bus_index: int = Field(ge=0, lt=MAX_VEHICLES)
    imu: str
    imu_serial_number: int | None = Field(default=None, ge=0, le=0xFFFFFFFF)
    star_camera: str | None = None
    fixes: str | None = None
    reference: str | None = None
    hold: HoldSection
    starts_by_itself: bool = True
    fix_sources: tuple[Literal["stars", "overhead"], ...] = ()

    @property
    def has_stars(self) -> bool:
        """Whether star fixes are made, or drawn in their place."""
        return self.star_camera is not None or self.fixes is not None

    @property
    def fused(self) -> tuple[str, ...]:
        """Whose fixes the estimator takes: those named, else the stars', else the overhead camera's."""
        return self.fix_sources or (("stars",) if self.has_stars else ("overhead",))

    @model_validator(mode="after")
    def _known_sources_of_fixes(self) -> Self:
        if self.star_camera is not None and self.fixes is not None:
            raise ValueError("needs only one of 'star_camera' and 'fixes'")
        if len(set(self.fix_sources)) < len(self.fix_sources):
            raise ValueError(f"fix_sources names a source twice: {', '.join(self.fix_sources)}")
        if "stars" in self.fused and not self.has_stars:
            raise ValueError("fix_sources 'stars' needs 'star_camera' or 'fixes'")
        return self


class RecordSection(Section):
    """Where recordings go, and what is kept of the camera's images."""

    directory: Path = Path("recordings")
    images: Literal["off", "spots", "lossless"] = "spots"


class NodeSection(Section):
    """What the rig says about one node: its process, and the time it takes (emulated conditions).

    ``busy_s``: takes one message at a time and answers after this long. ``late_s``: answers late, but
    takes every message.
    """

    process: str | None = None
    busy_s: NonNegative = 0.0
    late_s: NonNegative = 0.0

    @model_validator(mode="after")
    def _either(self) -> Self:
        if self.busy_s and self.late_s:
            raise ValueError("give either 'busy_s' or 'late_s'")
        return self


class LaboratorySection(BaseModel):
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
    """A whole rig."""

    name: str
    table: TableSection
    mock_ups: dict[str, MockUpSection]
    vehicles: dict[Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")], VehicleSection] = Field(min_length=1)
    valve_bus: dict[str, Any] | str
    overhead_camera: OverheadCameraSection | None = None
    record: RecordSection = RecordSection()
    nodes: dict[str, NodeSection] = Field(default_factory=dict)
    laboratory: LaboratorySection | None = None

    @model_validator(mode="after")
    def _known_interface(self) -> Self:
        if isinstance(self.valve_bus, dict):
            interface = self.valve_bus.get("interface")
            if interface not in can.VALID_INTERFACES:
                known = ", ".join(sorted(can.VALID_INTERFACES))
                raise ValueError(f"valve_bus.interface: {interface!r} is none of python-can's: {known}")
        return self

    @model_validator(mode="after")
    def _map_is_used(self) -> Self:
        for name, mock_up in self.mock_ups.items():
            method = mock_up.fusion.method
            if self.table.map is not None and method != "filter":
                raise ValueError(
                    f"table.map: the estimator {method!r} of mock_ups.{name} takes no map: "
                    "choose 'filter', or leave the map out"
                )
        return self

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        indices: dict[int, str] = {}
        imus: dict[str, str] = {}
        for name, vehicle in self.vehicles.items():
            mock_up = self.mock_ups.get(vehicle.mock_up)
            if mock_up is None:
                known = ", ".join(sorted(self.mock_ups)) or "none"
                raise ValueError(
                    f"vehicles.{name}.mock_up: {vehicle.mock_up!r} is not among mock_ups ({known})"
                )
            if vehicle.star_camera is not None and mock_up.star_camera is None:
                raise ValueError(
                    f"vehicles.{name}: an address without mock_ups.{vehicle.mock_up}.star_camera"
                )
            if "overhead" in vehicle.fused and self.overhead_camera is None:
                missing = "" if vehicle.fix_sources else "needs one of 'star_camera' and 'fixes', or "
                needs = missing or "fix_sources 'overhead' needs "
                raise ValueError(f"vehicles.{name}: {needs}an [overhead_camera] section")
            if len(vehicle.fused) > 1 and mock_up.fusion.method != "filter":
                raise ValueError(
                    f"vehicles.{name}.fix_sources: the estimator {mock_up.fusion.method!r} takes one source: "
                    "choose 'filter', or name one"
                )
            if vehicle.bus_index in indices:
                other = indices[vehicle.bus_index]
                raise ValueError(f"vehicles.{name}.bus_index: {vehicle.bus_index} is already that of {other}")
            indices[vehicle.bus_index] = name
            if vehicle.imu in imus:
                raise ValueError(
                    f"vehicles.{name}.imu: {vehicle.imu!r} is already that of {imus[vehicle.imu]}"
                )
            imus[vehicle.imu] = name
            if not self.table.holds(vehicle.hold.x_m, vehicle.hold.y_m):
                raise ValueError(
                    f"vehicles.{name}.hold: ({vehicle.hold.x_m:g}, {vehicle.hold.y_m:g}) m is nearer than "
                    f"{MOCK_UP_RADIUS_M:g} m to the table's edge, or beyond it"
                )
            addresses = {"imu": vehicle.imu, "star_camera": vehicle.star_camera, "fixes": vehicle.fixes}
            for key, address in addresses.items():
                if address is not None and address.startswith(LABORATORY) and self.laboratory is None:
                    raise ValueError(f"vehicles.{name}.{key}: {address!r} needs a [laboratory] section")
        overhead = self.overhead_camera
        if overhead is not None and overhead.address.startswith(LABORATORY) and self.laboratory is None:
            raise ValueError(f"overhead_camera.address: {overhead.address!r} needs a [laboratory] section")
        return self

    def mock_up_of(self, vehicle: str) -> MockUpSection:
        """The type of a vehicle."""
        return self.mock_ups[self.vehicles[vehicle].mock_up]


def load_rig(path: Path) -> Rig:
    """Read a rig file.

    Raises:
        RigError: One sentence with file and key or line.
    """
    try:
        text = path.read_text()
    except FileNotFoundError as error:
        raise RigError(f"{path}: there is no such rig file") from error
    except (OSError, UnicodeDecodeError) as error:
        raise RigError(f"{path}: cannot be read as a rig file ({error})") from error
    return parse_rig(text, path)


def parse_rig(text: str, path: Path) -> Rig:
    """Read the text of a rig file; relative paths inside are taken relative to ``path``.

    Raises:
        RigError: One sentence with file and key or line.
    """
    try:
        rig = Rig.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise RigError(f"{path}: is not valid TOML: {error}") from error
    except ValidationError as error:
        raise RigError(f"{path}: {_first_sentence(error)}") from error
    try:
        return _anchor(rig, path.parent)
    except CalibrationFileError as error:
        raise RigError(str(error)) from error


def _first_sentence(error: ValidationError) -> str:
    found = error.errors()
    typos = [each for each in found if each["type"] == "extra_forbidden"]
    first = (typos or found)[0]  # a typo in a required key is also a missing key: the typo says more
    where = ".".join(str(part) for part in first["loc"] if part != "[key]")
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        return f"'{where}' is no known key (a typo?)"
    if first["type"] == "missing":
        return f"'{where}' is missing"
    value = "" if first["type"] == "value_error" else f", found {first['input']!r}"
    return f"{where + ': ' if where else ''}{message}{value}"


def _anchor(rig: Rig, folder: Path) -> Rig:
    """Make calibration paths absolute."""
    mock_ups = {}
    for name, mock_up in rig.mock_ups.items():
        camera = mock_up.star_camera
        if camera is not None:
            camera = camera.anchored(folder)
        imu = mock_up.imu.model_copy(
            update={"calibration": tuple(folder / path for path in mock_up.imu.calibration)}
        )
        mock_ups[name] = mock_up.model_copy(update={"star_camera": camera, "imu": imu})
    laboratory = rig.laboratory
    if laboratory is not None:
        laboratory = laboratory.model_copy(update={"folder": str(folder.resolve())})
    table = rig.table
    if table.map is not None:
        table = table.model_copy(update={"map": folder / table.map})
    overhead = rig.overhead_camera
    if overhead is not None:
        overhead = overhead.model_copy(
            update={"camera": folder / overhead.camera, "circles": folder / overhead.circles}
        )
    rig = rig.model_copy(update={"overhead_camera": overhead})
    return rig.model_copy(update={"table": table, "mock_ups": mock_ups, "laboratory": laboratory})
