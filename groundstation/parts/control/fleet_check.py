"""What is wrong with a fleet as a whole: nobody leads, two hold one place, a corridor leads over the edge."""

import itertools
import math

from groundstation.control.controllers import controllers
from groundstation.control.leading import lost_followers
from groundstation.control.state import ControlState
from groundstation.declarations.rig import Rig
from groundstation.parts.control.sections import config_of, control_of, dockings_of, neighbours_of
from groundstation.supervision.apart import in_the_way, too_near


def check_leaders(rig: Rig) -> None:
    """Whoever follows others comes, over however many of them, to one who knows its own place.

    Raises:
        ValueError: Some follow each other in a circle, and nobody outside it leads them.
    """
    led_by = {
        name: controllers()[control_of(rig, name)[0].controller].led_by(config_of(rig, name))
        for name in rig.vehicles
    }
    lost = lost_followers(led_by)
    if not lost:
        return
    circle = [lost[0]]
    while (leader := led_by[circle[-1]][0]) not in circle:
        circle.append(leader)
    circle = [*circle[circle.index(leader) :], leader]
    links = ", ".join(f"{name} follows {whom}" for name, whom in itertools.pairwise(circle))
    key = control_of(rig, circle[0])[1]
    raise ValueError(f"{key}.parameters: {links}: nobody leads, so give one of them a way of its own")


def check_holds(rig: Rig) -> None:
    """Poses that are held at the same time are apart; who follows others is told by them where to go.

    Raises:
        ValueError: Two are too near to each other, or one is in an obstacle.
    """
    held = {name: rig.vehicles[name].hold for name in rig.vehicles if not neighbours_of(rig, name)}
    for name, hold in held.items():
        refusal = in_the_way((hold.x_m, hold.y_m), rig.table.obstacles())
        if refusal:
            raise ValueError(f"vehicles.{name}.hold: {refusal}")
    for (name, hold), (other, its) in itertools.combinations(held.items(), 2):
        apart_m = math.dist((hold.x_m, hold.y_m), (its.x_m, its.y_m))
        refusal = too_near(f"the hold pose of {name}", apart_m, relation="from there")
        if refusal:
            raise ValueError(f"vehicles.{other}.hold: {refusal}")


def check_corridors(rig: Rig) -> None:
    """The gate of a corridor to a target that holds its pose lies on the table, and in no obstacle.

    Raises:
        ValueError: One does not.
    """
    for ship, target, corridor in dockings_of(rig):
        if controllers()[control_of(rig, target)[0].controller].has_program:
            continue  # where it will be is not known beforehand
        hold = rig.vehicles[target].hold
        stands = ControlState((hold.x_m, hold.y_m), (0.0, 0.0), math.radians(hold.heading_deg), 0.0)
        (x_m, y_m), _ = corridor.place(stands, corridor.gate_m)
        key = f"{control_of(rig, ship)[1]}.parameters.axis_deg"
        where = f"the gate of the corridor to {target} would lie at ({x_m:.2f}, {y_m:.2f}) m"
        if min(rig.table.keep_in().edge_distances_m((x_m, y_m))) < 0.0:
            raise ValueError(
                f"{key}: {where}, outside the part of the table that vehicles keep to: give another axis, or "
                f"move the hold pose of {target}"
            )
        refusal = in_the_way((x_m, y_m), rig.table.obstacles())
        if refusal:
            raise ValueError(f"{key}: {where}: {refusal}")
