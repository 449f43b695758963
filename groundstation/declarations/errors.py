"""What can go wrong around the nodes.

GroundStationError
    UsageError   something the user gave is wrong: one sentence, exit code 2
        RigError     the rig file
    NodeError    a node raised what it must not, or published what it does not declare
"""


class GroundStationError(Exception):
    """Base of the errors of the ground station."""


class UsageError(GroundStationError):
    """What was asked for cannot be done as it was asked; the text is one sentence for people."""


class RigError(UsageError):
    """The rig file is wrong."""


class NodeError(GroundStationError):
    """A node raised something, or published what is not among its outputs; the text names it."""
