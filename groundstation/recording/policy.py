"""Which topics a recorder keeps: the rig's image policy."""

from enum import StrEnum

from groundstation.declarations.topic import Recorded, Topic


class ImagePolicy(StrEnum):
    """What of the cameras goes into a recording."""

    OFF = "off"  # neither images nor spots, nor pictures of refusals
    SPOTS = "spots"  # the spots found, some kB/s: star identification can be re-run; pictures of refusals
    LOSSLESS = "lossless"  # the raw images too: spot finding can be re-run


_KEPT = {
    Recorded.ALWAYS: frozenset(ImagePolicy),
    Recorded.SPOTS: frozenset({ImagePolicy.SPOTS, ImagePolicy.LOSSLESS}),
    Recorded.IMAGES: frozenset({ImagePolicy.LOSSLESS}),
}


def is_kept(topic: Topic, policy: ImagePolicy) -> bool:
    """Whether a recorder with this policy writes the topic."""
    return policy in _KEPT[topic.recorded]
