"""The edge of relative navigation: the camera on the hull, read by the same driver as a star camera."""

from dataclasses import dataclass

from groundstation.parts.edges import GreyCameraPort
from groundstation.parts.relative_navigation.messages import SideImage


@dataclass(frozen=True)
class SideCameraPort(GreyCameraPort):
    """The camera on the hull."""

    reads = SideImage
