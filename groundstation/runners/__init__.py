"""Three runners of the same nodes: live, lockstep and replay; what they have in common stands in ``step``."""
