"""Part ``supervision``: one supervisor per vehicle rules on valves and float air; faults move it."""

from groundstation.control.edge import braking_to_count_on
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.declarations.node import COMMANDS, FLIGHT, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import MOCK_UP_RADIUS_M, STATION_CHANNEL, Rig
from groundstation.fusion.hold_up import HoldUp
from groundstation.fusion.noise import lag_of_bandwidth
from groundstation.parts.control.sections import dockings_of, neighbours_of
from groundstation.parts.fusion.sections import FusionOfType, fused_sources
from groundstation.parts.imu.sections import ImuOfType
from groundstation.parts.relative_navigation.sections import RelativeNavigationOfVehicle
from groundstation.parts.stars.sections import StarsOfType, StarsOfVehicle
from groundstation.parts.supervision.actions import ACTIONS
from groundstation.parts.supervision.fault_detector import FaultDetector
from groundstation.parts.supervision.figures import SupervisionFigure
from groundstation.parts.supervision.gauges import GAUGES
from groundstation.parts.supervision.learned import LearnedFigure
from groundstation.parts.supervision.memory import MemoryPort
from groundstation.parts.supervision.messages import (
    Faults,
    Findings,
    Recalled,
    StopPress,
    Supervision,
    ValveShares,
    ValvesLearned,
)
from groundstation.parts.supervision.sections import SupervisionOfType, SupervisionOfVehicle
from groundstation.parts.supervision.supervisor_node import PERIOD_NS, SupervisorNode
from groundstation.parts.supervision.valve_learner import ValveLearner
from groundstation.supervision.imu_consistency import ImuConsistency, ImuConsistencyConfig
from groundstation.supervision.sightings import Sightings
from groundstation.supervision.supervisor import Supervisor
from groundstation.supervision.thrust_fit import FitConfig
from groundstation.supervision.valve_consistency import ValveConsistency, ValveConsistencyConfig
from groundstation.supervision.valve_estimate import IdentificationConfig
from groundstation.supervision.valve_identification import ValveIdentification

NODE_FRAMES_HZ, SPARE_FRAMES_HZ = 60.0, 100.0
"""What a valve node sends a second, and what others may send besides."""
HEADING_SIGMA_RAD = 0.002  # of fixes that are no camera's
EDGES_SIGMA_S = 2e-4
"""Of a dead time, however long is learned: samples of 10 ms blur edges, and sag is shared among valves."""


def _supervisor(rig: Rig, vehicle: str) -> Node:
    model = rig.type_of(vehicle).model()
    braking_m_s2 = braking_to_count_on(model, WrenchEnvelope(model))
    sightings = Sightings(
        rig.table.keep_in(),
        braking_m_s2,
        MOCK_UP_RADIUS_M,
        began_ns=0,
        most_frames_hz=2.0 * NODE_FRAMES_HZ * len(rig.vehicles) + SPARE_FRAMES_HZ,
        neighbours=neighbours_of(rig, vehicle),
        seen_leader=rig.vehicle(vehicle, RelativeNavigationOfVehicle).leader_seen(),
        name=vehicle,
        dockings=dockings_of(rig),
    )
    supervisor = Supervisor(
        sightings,
        rest_s=rig.of_type(vehicle, FusionOfType).fusion.rest_s,
        period_ns=PERIOD_NS,
        starts_by_itself=rig.vehicle(vehicle, SupervisionOfVehicle).starts_by_itself,
    )
    nodes = rig.tables.nodes
    absent = {
        row.name: f"this vehicle has no {row.answered_by.replace('_', ' ')}"
        for row in rig.tables.actions.values()
        if not {vehicle, ""} & set(nodes[row.answered_by].vehicles(rig))
    }
    others = tuple(name for name in rig.vehicles if name != vehicle)
    return SupervisorNode(vehicle, model, supervisor, others, frozenset(rig.tables.actions), absent)


def _detector(rig: Rig, vehicle: str) -> Node:
    type_, imu = rig.type_of(vehicle), rig.of_type(vehicle, ImuOfType).imu
    sources = {rig.tables.fix_sources[name].payload: name for name in fused_sources(rig, vehicle)}
    floors_rad = [rig.tables.fix_sources[name].floor(rig, vehicle)[1] for name in sources.values()]
    camera = rig.of_type(vehicle, StarsOfType).star_camera
    heading_sigma_rad = max(HEADING_SIGMA_RAD if camera is None else camera.sigma_heading_rad, *floors_rad)
    valves = ValveConsistencyConfig(
        fit=FitConfig(
            imu_position_body_m=imu.position_body_m,
            gyro_density_rad_s_rthz=imu.gyro_density_rad_s_rthz,
            acc_density_m_s2_rthz=imu.acc_density_m_s2_rthz,
        ),
        open_delay_s=type_.valves.open_delay_s,
        close_delay_s=type_.valves.close_delay_s,
        rise_s=type_.valves.rise_s,
        acc_lag_s=lag_of_bandwidth(imu.acc_bandwidth_hz),
        gyro_lag_s=lag_of_bandwidth(imu.gyro_bandwidth_hz),
    )
    gyro = ImuConsistencyConfig(
        gyro_density_rad_s_rthz=imu.gyro_density_rad_s_rthz, heading_sigma_rad=heading_sigma_rad
    )
    return FaultDetector(
        vehicle,
        sources,
        ValveConsistency(type_.model(), valves),
        ImuConsistency(gyro),
        HoldUp(imu.usual_spread_s),
        has_pictures=rig.vehicle(vehicle, StarsOfVehicle).star_camera is not None,
    )


def identification_config(rig: Rig, vehicle: str) -> IdentificationConfig:
    """What a rig states beforehand of a vehicle's valves and of the IMU that feels them."""
    type_, imu = rig.type_of(vehicle), rig.of_type(vehicle, ImuOfType).imu
    return IdentificationConfig(
        imu_position_body_m=imu.position_body_m,
        gyro_density_rad_s_rthz=imu.gyro_density_rad_s_rthz,
        acc_density_m_s2_rthz=imu.acc_density_m_s2_rthz,
        open_delay_s=type_.valves.open_delay_s,
        close_delay_s=type_.valves.close_delay_s,
        rise_s=type_.valves.rise_s,
        acc_lag_s=lag_of_bandwidth(imu.acc_bandwidth_hz),
        gyro_lag_s=lag_of_bandwidth(imu.gyro_bandwidth_hz),
        model_sigma_s=EDGES_SIGMA_S,
    )


def valve_learner(rig: Rig, vehicle: str) -> ValveLearner:
    """A node that learns a vehicle's valves."""
    known = identification_config(rig, vehicle)
    return ValveLearner(vehicle, ValveIdentification(rig.type_of(vehicle).model(), known))


def _learns(rig: Rig, vehicle: str) -> bool:
    return rig.of_type(vehicle, SupervisionOfType).learns_valves


def _memory(rig: Rig, vehicle: str) -> Port:
    del rig
    return MemoryPort(f"{vehicle}/memory", vehicle, f"{STATION_CHANNEL}memory")


PART = Part(
    name="supervision",
    summary="modes, stop, faults and the arming gate of each vehicle",
    topics=(Recalled, StopPress, Supervision, Faults, Findings, ValveShares, ValvesLearned),
    nodes=(
        NodeRow("supervisor", COMMANDS, Weight.URGENT, SupervisorNode, _supervisor),
        NodeRow("fault_detector", FLIGHT, Weight.LIGHT, FaultDetector, _detector),
        NodeRow("valve_learner", FLIGHT, Weight.LIGHT, ValveLearner, valve_learner, _learns),
    ),
    ports=(PortRow("supervisor", MemoryPort, _memory),),
    actions=tuple(ACTIONS.values()),
    mock_up=SupervisionOfType,
    vehicle=SupervisionOfVehicle,
    gauges=GAUGES,
    figures=(SupervisionFigure, LearnedFigure),
)
