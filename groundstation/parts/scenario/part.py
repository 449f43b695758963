"""Part ``scenario``: a timeline of requests, failures, markers and waits, carried out by a node."""

from groundstation.declarations.node import STATION, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.rig import Rig
from groundstation.parts.scenario.conditions import Bounds
from groundstation.parts.scenario.messages import Marker, ScenarioStatus
from groundstation.parts.scenario.player import START, Player
from groundstation.parts.scenario.sections import ScenarioOfRig


def bounds_of(rig: Rig) -> Bounds:
    """The table of a rig as conditions know it."""
    table = rig.table
    return Bounds((table.x_min_m, table.x_max_m), (table.y_min_m, table.y_max_m))


def _has_scenario(rig: Rig, vehicle: str) -> bool:
    del vehicle
    return rig.section(ScenarioOfRig).scenario is not None


def _player(rig: Rig, vehicle: str) -> Node:
    del vehicle
    section = rig.section(ScenarioOfRig).scenario
    assert section is not None
    return Player(section, tuple(rig.vehicles), bounds_of(rig))


PART = Part(
    name="scenario",
    summary="timelines: what is asked of vehicles and injected when, and when an experiment is over",
    topics=(Marker, ScenarioStatus),
    nodes=(NodeRow("player", STATION, Weight.LIGHT, Player, _player, _has_scenario, is_of_rig=True),),
    actions=(START,),
    rig=ScenarioOfRig,
)
