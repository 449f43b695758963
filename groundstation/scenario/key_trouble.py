"""What is wrong with a scenario that does not fit its rig."""


class KeyTroubleError(ValueError):
    """What is wrong with a scenario; the text begins with the key."""
