"""Keys of a rig that say how vehicles are supervised, and whether their valves are learned."""

from groundstation.declarations.section import Section


class SupervisionOfVehicle(Section):
    """Keys of a vehicle."""

    starts_by_itself: bool = True


class SupervisionOfType(Section):
    """Keys of a type of mock-up.

    Attributes:
        learns_valves: Thrust and dead time of each valve are learned in flight (`ValvesLearned`); it takes
            about 3 % of a core.
    """

    learns_valves: bool = False
