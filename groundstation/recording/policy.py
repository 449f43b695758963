"""Which topics a recorder keeps: the rig's image policy."""

from enum import StrEnum

from groundstation.bus.topics import TOPICS, Recorded, Topic, topic_of
from groundstation.messages.definitions import StarPicture, StarSpots


class ImagePolicy(StrEnum):
    """What of the cameras goes into a recording."""

    OFF = "off"  # neither images nor spots, nor pictures of refusals
    SPOTS = "spots"  # the spots found, some kB/s: star identification can be re-run; pictures of refusals
    LOSSLESS = "lossless"  # the raw images too: spot finding can be re-run


_IMAGES = frozenset(topic for topic in TOPICS if topic.recorded is Recorded.IMAGES)
_DROPPED = {
    ImagePolicy.OFF: _IMAGES | {topic_of(StarSpots), topic_of(StarPicture)},
    ImagePolicy.SPOTS: _IMAGES,
    ImagePolicy.LOSSLESS: frozenset[Topic](),
}


def is_kept(topic: Topic, policy: ImagePolicy) -> bool:
    """Whether a recorder with this policy writes the topic."""
    return topic not in _DROPPED[policy]
