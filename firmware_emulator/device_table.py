"""THE TABLE of devices, and the shape of the scenario that follows from it.

The emulator's own devices come first, in an order that decides who acts first at one moment and whose
arrival comes first at equal stamps; then those of installed packages (entry points of the group
`firmware_emulator.devices`), by name.
"""

from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points
from typing import Annotated, Any

from pydantic import Field, create_model

from drivers.errors import NotFound
from drivers.valve_bus.protocol import MAX_VEHICLES
from firmware_emulator.config import LaboratoryConfig
from firmware_emulator.device_kind import DeviceKind
from firmware_emulator.devices.drawn_fixes import FIXES
from firmware_emulator.devices.failure_channel import LABORATORY
from firmware_emulator.devices.imu import IMU
from firmware_emulator.devices.overhead_camera import OVERHEAD_CAMERA
from firmware_emulator.devices.side_camera import SIDE_CAMERA
from firmware_emulator.devices.star_camera import STAR_CAMERA
from firmware_emulator.devices.truth_stream import REFERENCE
from firmware_emulator.devices.valve_bus import VALVE_BUS
from firmware_emulator.failures import FAILURE_KINDS, FailureKind
from firmware_emulator.mock_up_config import VehicleConfig

ENTRY_POINT_GROUP = "firmware_emulator.devices"

OWN: tuple[DeviceKind[Any], ...] = (
    LABORATORY,  # a failure is there when the devices act at the moment of its beginning
    VALVE_BUS,  # a valve moves before somebody looks
    IMU,
    REFERENCE,
    FIXES,
    STAR_CAMERA,
    SIDE_CAMERA,
    OVERHEAD_CAMERA,
)


@cache
def device_kinds() -> tuple[DeviceKind[Any], ...]:
    """Every kind of device that can stand in the laboratory.

    Raises:
        NotFound: What an installed package offers cannot be loaded, is no device kind, or bears a name that
            another one has.
    """
    kinds = list(OWN)
    for point in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda point: point.name):
        package = point.dist.name if point.dist is not None else point.module
        where = f"device {point.name!r} of the package {package} ({point.value})"
        try:
            kind = point.load()
        except (
            Exception,
            SystemExit,
        ) as error:  # whatever a package of somebody else raises: it is named, once
            raise NotFound(f"{where} cannot be loaded: {type(error).__name__}: {error}") from error
        if not isinstance(kind, DeviceKind):
            raise NotFound(f"{where} is a {type(kind).__name__}, no DeviceKind")
        if kind.name in {other.name for other in kinds}:
            raise NotFound(f"{where}: there is another kind {kind.name!r}")
        kinds.append(kind)
    return tuple(kinds)


def failure_kinds(kinds: tuple[DeviceKind[Any], ...]) -> dict[str, FailureKind]:
    """Every kind of failure: the emulator's own, and those that devices bring.

    Raises:
        NotFound: Two of them bear one name.
    """
    found = dict(FAILURE_KINDS)
    for kind in kinds:
        for name, failure in kind.failures.items():
            if name in found:
                raise NotFound(f"device {kind.name!r}: there is another kind of failure {name!r}")
            found[name] = failure
    return found


def read_config(table: Mapping[str, object]) -> LaboratoryConfig:
    """Read the rig's `[laboratory]` table with a section for every kind of device.

    Raises:
        pydantic.ValidationError: The table is not a scenario; an unknown key is refused.
        NotFound: As of `device_kinds`.
    """
    kinds = device_kinds()
    return _model(kinds).model_validate(dict(table), context={"failure_kinds": failure_kinds(kinds)})


@cache
def _model(kinds: tuple[DeviceKind[Any], ...]) -> type[LaboratoryConfig]:
    vehicle: Any = create_model(
        "VehicleConfig", __base__=VehicleConfig, **_sections(kinds, VehicleConfig, is_shared=False)
    )
    vehicles = Annotated[tuple[vehicle, ...], Field(min_length=1, max_length=MAX_VEHICLES)]
    sections = _sections(kinds, LaboratoryConfig, is_shared=True)
    return create_model("LaboratoryConfig", __base__=LaboratoryConfig, vehicles=(vehicles, ...), **sections)


def _sections(
    kinds: tuple[DeviceKind[Any], ...], table: type[LaboratoryConfig | VehicleConfig], *, is_shared: bool
) -> dict[str, Any]:
    """Fields of the devices' sections for `create_model`."""
    shapes: dict[str, Any] = {}
    fields: dict[str, Any] = {}
    for kind in kinds:
        if kind.is_shared != is_shared or kind.settings is None:
            continue
        if kind.section in table.model_fields or shapes.setdefault(kind.section, kind.settings) is not (
            kind.settings
        ):
            raise NotFound(f"device {kind.name!r}: the key {kind.section!r} means something else already")
        standard = kind.settings() if kind.is_standard else None
        fields[kind.section] = (kind.settings if kind.is_standard else kind.settings | None, standard)
    return fields
