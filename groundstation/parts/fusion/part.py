"""Part ``fusion``: IMU samples and late fixes become the vehicle's state."""

from collections.abc import Mapping

from groundstation.control.valve_push import ValvePush
from groundstation.declarations.node import FLIGHT, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.rig import Rig
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import Estimator
from groundstation.fusion.estimators import ESTIMATORS, PUBLISHED
from groundstation.fusion.rest_clock import RestClock
from groundstation.parts.fusion.estimation import calibration_texts, floors_of, noise_of, rig_noise
from groundstation.parts.fusion.force_stand_in import ForceStandIn
from groundstation.parts.fusion.fusion import NO_FILES, Fusion
from groundstation.parts.fusion.gauges import FIGURES, GAUGES
from groundstation.parts.fusion.messages import FixAccount, FusionCalibration, FusionStatus, VehicleState
from groundstation.parts.fusion.sections import FusionOfType, FusionOfVehicle, FusionSection, fused_sources


def _fusion(rig: Rig, vehicle: str) -> Node:
    section = rig.of_type(vehicle, FusionOfType).fusion
    estimator, method = _estimator(rig, vehicle, section), section.method
    type_ = rig.type_of(vehicle)
    push = ValvePush(type_.model(), type_.valves.open_delay_s, type_.valves.close_delay_s)
    stand_in = ForceStandIn(estimator, push, type_.mass_kg, type_.inertia_kg_m2)
    return fusion_node(rig, vehicle, estimator, method, calibration_texts(rig, vehicle), stand_in)


def _estimator(rig: Rig, vehicle: str, section: FusionSection) -> Estimator:
    noise, grid = noise_of(rig, vehicle), rig.table.slope_grid()
    if section.method in PUBLISHED:
        return PUBLISHED[section.method](noise, section.published)
    return ESTIMATORS[section.method](noise) if grid is None else ErrorStateFilter(noise, table_map=grid)


def fusion_node(
    rig: Rig,
    vehicle: str,
    estimator: Estimator,
    method: str = "filter",
    calibration: Mapping[str, tuple[str, str]] = NO_FILES,
    stand_in: ForceStandIn | None = None,
) -> Fusion:
    """The fusion node of a vehicle around an estimator, with the fixes that the rig lets it take."""
    sources = rig.tables.fix_sources
    payloads = {name: sources[name].payload for name in fused_sources(rig, vehicle)}
    floors, rest = floors_of(rig, vehicle), RestClock(rig_noise(rig, vehicle))
    return Fusion(vehicle, estimator, method, payloads, floors, rest, calibration, stand_in)


def _check(rig: Rig) -> None:
    for name, type_ in rig.mock_ups.items():
        assert isinstance(type_, FusionOfType)
        if rig.table.map is not None and type_.fusion.method != "filter":
            raise ValueError(
                f"table.map: the estimator {type_.fusion.method!r} of mock_ups.{name} takes no map: "
                "choose 'filter', or leave the map out"
            )
    for name in rig.vehicles:
        _check_sources(rig, name)
        noise_of(rig, name)  # reads the table map and the IMU's calibration


def _check_sources(rig: Rig, name: str) -> None:
    named = rig.vehicle(name, FusionOfVehicle).fix_sources
    known = rig.tables.fix_sources
    if len(set(named)) < len(named):
        raise ValueError(f"vehicles.{name}: fix_sources names a source twice: {', '.join(named)}")
    for source in named:
        if source not in known:
            raise ValueError(
                f"vehicles.{name}.fix_sources: {source!r} is no source of fixes "
                f"(there are {', '.join(known)})"
            )
        if not known[source].condition(rig, name):
            raise ValueError(f"vehicles.{name}: fix_sources {source!r} needs {known[source].needs}")
    fused = fused_sources(rig, name)
    if not fused:
        needs = ", or ".join(source.needs for source in known.values())
        raise ValueError(f"vehicles.{name}: nothing says where it is: it needs {needs}")
    method = rig.of_type(name, FusionOfType).fusion.method
    if len(fused) > 1 and method != "filter":
        raise ValueError(
            f"vehicles.{name}.fix_sources: the estimator {method!r} takes one source: "
            "choose 'filter', or name one"
        )


PART = Part(
    name="fusion",
    summary="samples and late fixes become the state of the centre of mass",
    topics=(VehicleState, FixAccount, FusionStatus, FusionCalibration),
    nodes=(NodeRow("fusion", FLIGHT, Weight.URGENT, Fusion, _fusion),),
    mock_up=FusionOfType,
    vehicle=FusionOfVehicle,
    check=_check,
    gauges=GAUGES,
    figures=FIGURES,
)
