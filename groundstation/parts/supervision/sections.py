"""Keys of a vehicle that say how it is supervised."""

from groundstation.declarations.section import Section


class SupervisionOfVehicle(Section):
    """Keys of a vehicle."""

    starts_by_itself: bool = True
