"""Keys of a rig file for range finders."""

from groundstation.declarations.section import NonNegative, Positive, Section


class RangeFinderSection(Section):
    """The device: its line, its noise, and how late its lines arrive."""

    baud: int = 115200
    sigma_m: Positive = 0.003
    delay_s: NonNegative = 0.002


class RangeFinderOfType(Section):
    """Keys of a type of mock-up."""

    range_finder: RangeFinderSection = RangeFinderSection()


class RangeFinderOfVehicle(Section):
    """Keys of a vehicle: where its device is opened; without the key it has none."""

    range_finder: str | None = None
