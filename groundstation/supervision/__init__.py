"""What decides whether a vehicle may fly: modes, faults, checks. Pure."""
