"""Names of recorded channels: ``/alpha/state``, ``/can_in``, ``/alpha_flight/journal``.

The last part is the topic's noun; what stands before it is the owner: a vehicle, a process, or nothing
where the topic belongs to the whole rig.
"""

from groundstation.bus.topics import Scope, Topic, topic_named


def channel_name(topic: Topic, owner: str) -> str:
    """Name of the channel of one topic of one owner."""
    if topic.scope is Scope.RIG or not owner:
        return f"/{topic.noun}"
    return f"/{owner}/{topic.noun}"


def parse_channel(name: str) -> tuple[Topic, str] | None:
    """Topic and owner of a channel; None for a channel that is not of the topic table."""
    owner, slash, noun = name.removeprefix("/").rpartition("/")
    del slash
    try:
        return topic_named(noun), owner
    except KeyError:
        return None
