"""How each node is made from the rig: the one place that reads rig sections into configurations."""

import math

from drivers.valve_bus.guard import Guard as Gate
from drivers.valve_bus.valve_budget import OpenTimeLimits
from groundstation.control.allocation import Allocator
from groundstation.control.brake import BrakeConfig
from groundstation.control.keep_in import KeepIn, rectangle
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.mux import MuxConfig
from groundstation.control.registry import make_controller
from groundstation.control.state import Goal
from groundstation.control.valve_push import ValvePush
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.registry import ESTIMATORS
from groundstation.nodes.allocation import Allocation
from groundstation.nodes.command_mux import CommandMux
from groundstation.nodes.controller import Controller
from groundstation.nodes.fix_reader import FixReader
from groundstation.nodes.fix_referee import FixReferee
from groundstation.nodes.force_stand_in import ForceStandIn
from groundstation.nodes.fusion import Fusion
from groundstation.nodes.guard import Guard
from groundstation.nodes.imu_reader import ImuReader
from groundstation.nodes.node import Node
from groundstation.nodes.reference_reader import ReferenceReader
from groundstation.nodes.start_sequence import StartSequence
from groundstation.nodes.valve_writer import ValveWriter
from groundstation.runtime.estimation import (
    calibration_texts,
    fix_floors_of,
    fused_floors_of,
    noise_of,
    slope_grid_of,
)
from groundstation.runtime.rig import MOCK_UP_RADIUS_M, Rig
from groundstation.runtime.rig_mock_up import MockUpSection
from groundstation.star_tracking.camera_model import CameraCalibration


def _model(mock_up: MockUpSection) -> VehicleModel:
    valves = square_of_eight(mock_up.valves.arm_m, mock_up.valves.thrust_n)
    return VehicleModel(mock_up.mass_kg, mock_up.inertia_kg_m2, valves)


def _modulator(mock_up: MockUpSection) -> PulseModulator:
    valves = mock_up.valves
    config = PulseConfig(
        period_s=valves.period_s,
        min_on_s=valves.min_on_s,
        open_delay_s=valves.open_delay_s,
        close_delay_s=valves.close_delay_s,
    )
    return PulseModulator(Allocator(_model(mock_up)), config)


def _keep_in(rig: Rig) -> KeepIn:
    table = rig.table
    size = (table.x_max_m - table.x_min_m, table.y_max_m - table.y_min_m)
    centre = ((table.x_max_m + table.x_min_m) / 2, (table.y_max_m + table.y_min_m) / 2)
    return rectangle(size, margin_m=MOCK_UP_RADIUS_M, centre_table_m=centre)


def command_mux(rig: Rig, vehicle: str) -> Node:
    """The multiplexer of a vehicle, with modulators of its own for braking and for pushing by hand."""
    mock_up = rig.mock_up_of(vehicle)
    model, modulators = _model(mock_up), (_modulator(mock_up), _modulator(mock_up))
    return CommandMux(vehicle, MuxConfig(), BrakeConfig(), model, modulators, _keep_in(rig))


def guard(rig: Rig, vehicle: str) -> Node:
    """The guard of a vehicle's valves."""
    limits = OpenTimeLimits(max_open_s=rig.mock_up_of(vehicle).valves.max_open_s)
    return Guard(vehicle, Gate(rig.vehicles[vehicle].bus_index, limits))


def valve_writer(rig: Rig, vehicle: str) -> Node:
    """The speaker on the valve bus."""
    return ValveWriter(vehicle, rig.vehicles[vehicle].bus_index)


def imu_reader(rig: Rig, vehicle: str) -> Node:
    """Parser, clock and scales of the IMU block."""
    imu = rig.mock_up_of(vehicle).imu
    serial_number = rig.vehicles[vehicle].imu_serial_number
    given_c = math.nan if imu.temperature_c is None else imu.temperature_c
    return ImuReader(
        vehicle, imu.protocol, imu.baud, imu.ftdi_latency_s, imu.averaging, serial_number, given_c
    )


def fix_reader(rig: Rig, vehicle: str) -> Node:
    """The reader of an external pose stream."""
    camera = rig.mock_up_of(vehicle).star_camera
    return FixReader(vehicle, camera.delay_sigma_s if camera is not None else 0.0)


def spot_finder(rig: Rig, vehicle: str) -> Node:
    """Detection of stars in frames."""
    from groundstation.nodes.spot_finder import SpotFinder  # OpenCV loads only where it is used

    camera = rig.mock_up_of(vehicle).star_camera
    assert camera is not None
    lens = CameraCalibration.load(camera.camera)
    return SpotFinder(vehicle, (lens.width, lens.height))


def picture_keeper(rig: Rig, vehicle: str) -> Node:
    """The last frames, for those that the star tracker speaks of."""
    from groundstation.nodes.picture_keeper import PictureKeeper  # OpenCV loads only where it is used

    del rig
    return PictureKeeper(vehicle)


def star_tracker(rig: Rig, vehicle: str) -> Node:
    """Identification and pose."""
    from groundstation.nodes.star_tracker import StarTracker  # OpenCV loads only where it is used
    from groundstation.star_tracking.tracker import TrackerSettings

    camera = rig.mock_up_of(vehicle).star_camera
    assert camera is not None
    settings = TrackerSettings(exposure_s=camera.exposure_s, readout_s=camera.readout_s)
    return StarTracker(vehicle, camera.camera, camera.ceiling, camera.delay_sigma_s, settings)


def overhead_tracker(rig: Rig, vehicle: str) -> Node:
    """All mock-ups in the picture from above."""
    from groundstation.nodes.overhead_tracker import OverheadTracker  # OpenCV loads only where it is used

    del vehicle
    camera = rig.overhead_camera
    assert camera is not None
    return OverheadTracker(tuple(rig.vehicles), camera.camera, camera.circles, camera.delay_sigma_s)


def fix_referee(rig: Rig, vehicle: str) -> Node:
    """Star fixes against overhead fixes."""
    floors = fix_floors_of(rig, vehicle)
    return FixReferee(vehicle, floors["stars"], floors["overhead"])


def fusion(rig: Rig, vehicle: str) -> Node:
    """The rig's estimator with its noise model and what calibration files say."""
    method = rig.mock_up_of(vehicle).fusion.method
    noise, grid = noise_of(rig, vehicle), slope_grid_of(rig)
    estimator = ESTIMATORS[method](noise) if grid is None else ErrorStateFilter(noise, table_map=grid)
    mock_up = rig.mock_up_of(vehicle)
    push = ValvePush(_model(mock_up), mock_up.valves.open_delay_s, mock_up.valves.close_delay_s)
    stand_in = ForceStandIn(estimator, push, mock_up.mass_kg, mock_up.inertia_kg_m2)
    floors, files = fused_floors_of(rig, vehicle), calibration_texts(rig, vehicle)
    return Fusion(vehicle, estimator, method, floors, files, stand_in)


def controller(rig: Rig, vehicle: str) -> Node:
    """The rig's controller, holding the vehicle's pose of the rig file."""
    mock_up, hold = rig.mock_up_of(vehicle), rig.vehicles[vehicle].hold
    section, keep_in = mock_up.control, _keep_in(rig)
    law = make_controller(section.controller, section.parameters, _model(mock_up), keep_in)
    goal = Goal((hold.x_m, hold.y_m), math.radians(hold.heading_deg))
    neighbours = tuple(name for name in section.parameters.get("neighbours", {}) if name in rig.vehicles)
    period_s = mock_up.valves.period_s
    return Controller(
        vehicle, law, section.controller, goal, keep_in, neighbours, period_s, slope_grid_of(rig)
    )


def allocation(rig: Rig, vehicle: str) -> Node:
    """Allocation and pulse modulation."""
    return Allocation(vehicle, _modulator(rig.mock_up_of(vehicle)))


def start_sequence(rig: Rig, vehicle: str) -> Node:
    """The start sequence of a vehicle."""
    return StartSequence(vehicle, rig.mock_up_of(vehicle).fusion.rest_s)


def reference_reader(rig: Rig, vehicle: str) -> Node:
    """The reader of truth or motion capture."""
    del rig
    return ReferenceReader(vehicle)
