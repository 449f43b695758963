"""THE TABLE of ways to find another mock-up in a side camera's picture.

====================  ==================================================================================
``markers``           round lamps at known places of its hull: place and turn
``lit_part``          the part of a plain hull that the sun lamp lights: its place; no turn can be seen
====================  ==================================================================================
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.lit_part import find_by_lit_part
from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.planar_markers import find_by_markers
from groundstation.relative_navigation.side_bodies import SideBody
from groundstation.relative_navigation.side_camera import SideCamera
from groundstation.relative_navigation.sighting import Seen, Unseen
from groundstation.relative_navigation.spots import SpotFinder, SpotSettings, Trouble

Picture = NDArray[np.uint8]
Look = Callable[[Picture], Seen | Unseen]

MARKER_LEVEL = 0.4
"""Between the darkest and the brightest of a picture: markers outshine the hull that they are glued on."""
LEAST_RADIUS_PX = 1.2
"""A hot pixel is no marker."""

VARIANCE_SHARE = 0.05
"""Of what the table of centres states of any blob: the mean over a hundred pixels of an even spot is better
than a twelfth of a pixel; measured from 0.8 to 2.5 m."""


def look_for_markers(camera: SideCamera, body: SideBody) -> Look:
    """Find a body by its markers.

    Raises:
        ValueError: It has none, or they are all at the camera's height.
    """
    if not body.azimuths_rad:
        raise ValueError(f"{body.vehicle} has no markers to be found by")
    finder = SpotFinder(SpotSettings(level=MARKER_LEVEL, least_radius_px=LEAST_RADIUS_PX))

    def look(picture: Picture) -> Seen | Unseen:
        spots = finder.look(picture)
        if spots.trouble is not Trouble.NONE:
            return Unseen(str(spots.trouble))
        centres = Centres(spots.centres.pixels, VARIANCE_SHARE * spots.centres.covariances)
        answer = find_by_markers(camera, body, centres)
        if isinstance(answer, Unseen) and spots.glare > 0.0:
            return Unseen(f"{Trouble.GLARE}: {answer.reason}", answer.is_ambiguous)
        return answer

    return look


def look_for_lit_part(camera: SideCamera, body: SideBody) -> Look:
    """Find a plain body by its lit part.

    Raises:
        ValueError: The camera would look onto it or under it.
    """
    body.check_seen_from(camera.position_body_m[2])
    return lambda picture: find_by_lit_part(camera, body, picture)


LOOKS: Mapping[str, Callable[[SideCamera, SideBody], Look]] = MappingProxyType(
    {"markers": look_for_markers, "lit_part": look_for_lit_part}
)
