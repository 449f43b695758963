"""Part ``supervision``: one supervisor per vehicle rules on valves and float air; faults move it."""

from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.declarations.node import COMMANDS, FLIGHT, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import MOCK_UP_RADIUS_M, STATION, Rig
from groundstation.parts.control.sections import neighbours_of
from groundstation.parts.fusion.sections import FusionOfType, fix_payloads
from groundstation.parts.supervision.actions import ACTIONS
from groundstation.parts.supervision.fault_detector import FaultDetector
from groundstation.parts.supervision.figures import SupervisionFigure
from groundstation.parts.supervision.gauges import GAUGES
from groundstation.parts.supervision.memory import MemoryPort
from groundstation.parts.supervision.messages import Faults, Findings, Recalled, StopPress, Supervision
from groundstation.parts.supervision.sections import SupervisionOfVehicle
from groundstation.parts.supervision.supervisor_node import PERIOD_NS, SupervisorNode
from groundstation.supervision.sightings import Sightings
from groundstation.supervision.supervisor import Supervisor

RELIED_ON = 0.9  # of the nominal thrust: spread and sag of the valves
SLOPE_M_S2 = 0.005  # a table half a milliradian off level


def _supervisor(rig: Rig, vehicle: str) -> Node:
    model = rig.type_of(vehicle).model()
    braking_m_s2 = RELIED_ON * WrenchEnvelope(model).max_force_n / model.mass_kg - SLOPE_M_S2
    sightings = Sightings(
        rig.table.keep_in(),
        braking_m_s2,
        MOCK_UP_RADIUS_M,
        began_ns=0,
        leaders=neighbours_of(rig, vehicle),
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
    return SupervisorNode(vehicle, supervisor, others, frozenset(rig.tables.actions), absent)


def _detector(rig: Rig, vehicle: str) -> Node:
    return FaultDetector(vehicle, fix_payloads(rig, vehicle))


def _memory(rig: Rig, vehicle: str) -> Port:
    del rig
    return MemoryPort(f"{vehicle}/memory", vehicle, f"{STATION}memory")


PART = Part(
    name="supervision",
    summary="modes, stop, faults and the arming gate of each vehicle",
    topics=(Recalled, StopPress, Supervision, Faults, Findings),
    nodes=(
        NodeRow("supervisor", COMMANDS, Weight.URGENT, SupervisorNode, _supervisor),
        NodeRow("fault_detector", FLIGHT, Weight.LIGHT, FaultDetector, _detector),
    ),
    ports=(PortRow("supervisor", MemoryPort, _memory),),
    actions=tuple(ACTIONS.values()),
    vehicle=SupervisionOfVehicle,
    gauges=GAUGES,
    figures=(SupervisionFigure,),
)
