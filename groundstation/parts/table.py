"""The table of parts: those of the tree, then those of installed packages.

A package adds its own by an entry point of the group ``groundstation.parts``.
"""

from dataclasses import replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points

from groundstation.bus.journal import Journal
from groundstation.declarations.errors import UsageError
from groundstation.declarations.part import Part
from groundstation.declarations.tables import PartError, Tables

ENTRY_POINT_GROUP = "groundstation.parts"
OUR_PACKAGE = "groundstation"


@cache
def installed_tables() -> Tables:
    """The tables of all parts; parts are imported at the first call.

    Raises:
        UsageError: A part of an installed package cannot be loaded or clashes with another.
    """
    points = sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda point: point.name)
    try:
        return Tables((*_own_parts(), *map(_load, points)), topics=(Journal,))
    except PartError as error:
        raise UsageError(str(error)) from error


@cache
def own_tables() -> Tables:
    """The tables of the tree's own parts: for what must work whatever else is installed, such as a stop."""
    return Tables(_own_parts(), topics=(Journal,))


def _own_parts() -> tuple[Part, ...]:
    from groundstation.parts.control.part import PART as CONTROL
    from groundstation.parts.fusion.part import PART as FUSION
    from groundstation.parts.imu.part import PART as IMU
    from groundstation.parts.laboratory.part import PART as LABORATORY
    from groundstation.parts.operation.part import PART as OPERATION
    from groundstation.parts.outside.part import PART as OUTSIDE
    from groundstation.parts.overhead.part import PART as OVERHEAD
    from groundstation.parts.reference.part import PART as REFERENCE
    from groundstation.parts.relative_navigation.part import PART as RELATIVE_NAVIGATION
    from groundstation.parts.scenario.part import PART as SCENARIO
    from groundstation.parts.stars.part import PART as STARS
    from groundstation.parts.supervision.part import PART as SUPERVISION
    from groundstation.parts.valves.part import PART as VALVES

    return (
        SUPERVISION, VALVES, IMU, STARS, OVERHEAD, FUSION, RELATIVE_NAVIGATION, CONTROL, OPERATION, OUTSIDE,
        SCENARIO, LABORATORY, REFERENCE,
    )  # fmt: skip


def _load(point: EntryPoint) -> Part:
    package = point.dist.name if point.dist is not None else point.module
    where = f"the part {point.name!r} of the package {package} ({point.value})"
    try:
        part = point.load()
    except (Exception, SystemExit) as error:  # whatever somebody else's package raises: it is named, once
        raise UsageError(f"{where} cannot be loaded: {type(error).__name__}: {error}") from error
    if not isinstance(part, Part):
        raise UsageError(f"{where} is a {type(part).__name__}, expected a Part")
    return part if package == OUR_PACKAGE else replace(part, package=package)
