"""Names of recorded channels: ``/alpha/state``, ``/can_in``, ``/alpha_flight/journal``.

The last part is the topic's noun; what stands before it is the owner: a vehicle, a process, or nothing
where the topic belongs to the whole rig.
"""


def channel_name(noun: str, owner: str) -> str:
    """Name of the channel of one topic of one owner."""
    return f"/{owner}/{noun}" if owner else f"/{noun}"


def parse_channel(name: str) -> tuple[str, str]:
    """Noun and owner of a channel."""
    owner, _, noun = name.removeprefix("/").rpartition("/")
    return noun, owner
