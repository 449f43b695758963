"""Whether a vehicle may fly: modes, stop, faults, arming."""
