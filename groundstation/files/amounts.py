"""What a number can mean by its unit, as ``drivers.files`` judges it for the emulator, too."""

from drivers.files.amounts import UNITLESS, check_amounts, fault_of

__all__ = ["UNITLESS", "check_amounts", "fault_of"]
