"""THE TABLE of nodes: what runs, for whom, in which process, and how it is made from the rig.

A heavy node has a process of its own kind: the launcher refuses to put it together with IMU, fusion or
valve nodes, whose work must never wait.
"""

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto

from groundstation.bus.journal import JournalWriter
from groundstation.nodes.node import Node
from groundstation.overhead.liveries import load_liveries
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.runtime import factories
from groundstation.runtime.errors import RigError
from groundstation.runtime.estimation import noise_of
from groundstation.runtime.rig import Rig
from groundstation.runtime.slot import NodeSlot, Sequences, Timing
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.star_catalogue import StarCatalogue


class Weight(Enum):
    """What a node may share a process with."""

    HEAVY = auto()  # never with an urgent node
    LIGHT = auto()
    URGENT = auto()  # IMU, fusion, valves: never with a heavy node


@dataclass(frozen=True, slots=True)
class NodeRow:
    """One row.

    Attributes:
        name: As in rig files, journals and health.
        process: Default process; ``{vehicle}`` is filled in.
        weight: What it may share a process with.
        make: Builds it from the rig for a vehicle.
        condition: Whether a vehicle has it.
        is_of_rig: One for the whole rig instead of one per vehicle; its vehicle is empty.
    """

    name: str
    process: str
    weight: Weight
    make: Callable[[Rig, str], Node]
    condition: Callable[[Rig, str], bool] = lambda _rig, _vehicle: True
    is_of_rig: bool = False

    def vehicles(self, rig: Rig) -> list[str]:
        """Vehicles that have this node; one empty name for a node of the rig."""
        if self.is_of_rig:
            return [""] if self.condition(rig, "") else []
        return [name for name in rig.vehicles if self.condition(rig, name)]


def _has_camera(rig: Rig, vehicle: str) -> bool:
    return rig.vehicles[vehicle].star_camera is not None


def _has_fix_stream(rig: Rig, vehicle: str) -> bool:
    return rig.vehicles[vehicle].fixes is not None


def _has_reference(rig: Rig, vehicle: str) -> bool:
    return rig.vehicles[vehicle].reference is not None


def _has_overhead_camera(rig: Rig, _vehicle: str) -> bool:
    return rig.overhead_camera is not None


def _has_two_sources(rig: Rig, vehicle: str) -> bool:
    return rig.overhead_camera is not None and rig.vehicles[vehicle].has_stars


def _starts_by_itself(rig: Rig, vehicle: str) -> bool:
    return rig.vehicles[vehicle].starts_by_itself


_FLIGHT, _SKY, _COMMANDS, _STATION = "{vehicle}_flight", "{vehicle}_sky", "commands", "station"

NODES: tuple[NodeRow, ...] = (
    NodeRow("command_mux", _COMMANDS, Weight.URGENT, factories.command_mux),
    NodeRow("guard", _COMMANDS, Weight.URGENT, factories.guard),
    NodeRow("valve_writer", _COMMANDS, Weight.URGENT, factories.valve_writer),
    NodeRow("imu_reader", _FLIGHT, Weight.URGENT, factories.imu_reader),
    NodeRow("fix_reader", _FLIGHT, Weight.LIGHT, factories.fix_reader, _has_fix_stream),
    NodeRow("spot_finder", _SKY, Weight.HEAVY, factories.spot_finder, _has_camera),
    NodeRow("star_tracker", _SKY, Weight.HEAVY, factories.star_tracker, _has_camera),
    NodeRow("picture_keeper", _SKY, Weight.HEAVY, factories.picture_keeper, _has_camera),
    NodeRow(
        "overhead_tracker",
        "overhead",
        Weight.HEAVY,
        factories.overhead_tracker,
        _has_overhead_camera,
        is_of_rig=True,
    ),
    NodeRow("fusion", _FLIGHT, Weight.URGENT, factories.fusion),
    NodeRow("controller", _FLIGHT, Weight.LIGHT, factories.controller),
    NodeRow("allocation", _FLIGHT, Weight.LIGHT, factories.allocation),
    NodeRow("fix_referee", _STATION, Weight.LIGHT, factories.fix_referee, _has_two_sources),
    NodeRow("start_sequence", _STATION, Weight.LIGHT, factories.start_sequence, _starts_by_itself),
    NodeRow("reference_reader", _STATION, Weight.LIGHT, factories.reference_reader, _has_reference),
)
_BY_NAME = {row.name: row for row in NODES}


def key_of(row: NodeRow, vehicle: str) -> str:
    """Key of a node in journals: ``vehicle/name``, or ``name`` for a node of the rig."""
    return f"{vehicle}/{row.name}" if vehicle else row.name


def process_of(rig: Rig, row: NodeRow, vehicle: str) -> str:
    """Process of a node: the rig's word, or the row's."""
    section = rig.nodes.get(row.name)
    template = section.process if section is not None and section.process else row.process
    return template.replace("{vehicle}", vehicle)


def check_rig(rig: Rig) -> None:
    """Refuse a rig before anything is started: node names, placement, calibration files.

    Raises:
        RigError: An unknown node, a heavy node together with an urgent one, a wrong table map or calibration.
        CalibrationFileError: A file of a star camera is missing or wrong.
    """
    for vehicle in rig.vehicles:
        noise_of(rig, vehicle)  # reads the table map and the IMU's calibration
    for mock_up in rig.mock_ups.values():
        if mock_up.star_camera is not None:
            CameraCalibration.load(mock_up.star_camera.camera)
            StarCatalogue.load(mock_up.star_camera.ceiling)
    _check_overhead(rig)
    unknown = set(rig.nodes) - set(_BY_NAME)
    if unknown:
        raise RigError(f"nodes.{unknown.pop()}: no such node (there are {', '.join(_BY_NAME)})")
    inside: dict[str, dict[Weight, str]] = {}
    for row in NODES:
        for vehicle in row.vehicles(rig):
            found = inside.setdefault(process_of(rig, row, vehicle), {})
            found.setdefault(row.weight, row.name)
    for process, weights in inside.items():
        if Weight.HEAVY in weights and Weight.URGENT in weights:
            heavy, urgent = weights[Weight.HEAVY], weights[Weight.URGENT]
            raise RigError(
                f"process '{process}' holds {heavy}, which is heavy, beside {urgent}, which must not wait"
            )


def _check_overhead(rig: Rig) -> None:
    if rig.overhead_camera is None:
        return
    OverheadCamera.load(rig.overhead_camera.camera)
    dressed = {livery.vehicle for livery in load_liveries(rig.overhead_camera.circles)}
    for vehicle in rig.vehicles:
        if vehicle not in dressed:
            raise RigError(
                f"overhead_camera.circles: {rig.overhead_camera.circles} has no table [{vehicle}] for the "
                "vehicle of that name"
            )


def make_node(rig: Rig, key: str) -> Node:
    """Build the node of a journal's key.

    Raises:
        KeyError: The rig has no such node.
    """
    vehicle, _, name = key.rpartition("/")
    row = _BY_NAME[name]
    if vehicle not in row.vehicles(rig):
        raise KeyError(key)
    return row.make(rig, vehicle)


def build_slots(
    rig: Rig, process: str | None, journal: JournalWriter, sequences: Sequences, *, measure: bool = True
) -> list[NodeSlot]:
    """Build the nodes of a process, or of all processes if None, in the order of the table.

    Raises:
        RigError: The rig's placement is refused, or a calibration file is wrong.
    """
    check_rig(rig)
    slots = []
    for row in NODES:
        for vehicle in row.vehicles(rig):
            home = process_of(rig, row, vehicle)
            if process is not None and process != home:
                continue
            section = rig.nodes.get(row.name)
            timing = Timing()
            if section is not None:
                timing = Timing(round(section.busy_s * 1e9), round(section.late_s * 1e9))
            config_crc = zlib.crc32(rig.model_dump_json().encode())
            node = row.make(rig, vehicle)
            slots.append(
                NodeSlot(
                    key_of(row, vehicle),
                    node,
                    process or "lockstep",
                    config_crc,
                    journal,
                    sequences,
                    measure,
                    timing,
                )
            )
    return slots
