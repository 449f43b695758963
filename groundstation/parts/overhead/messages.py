"""What the camera over the table sees, and how its fixes compare with those of the star tracker."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.camera_image import CameraImage
from groundstation.declarations.fix import PoseFix
from groundstation.declarations.message import (
    F64,
    PACKAGE,
    U16,
    Float64x3,
    Message,
    Text,
)
from groundstation.declarations.topic import Delivery, Rank, Recorded, Scope, Topic


@dataclass(frozen=True, slots=True, eq=False)
class OverheadImage(CameraImage):
    """One colour picture of the camera over the table; the stamp is its arrival."""

    TOPIC: ClassVar = Topic(
        "overhead_image",
        10,
        Rank.SENSOR,
        scope=Scope.RIG,
        delivery=Delivery.NEWEST,
        recorded=Recorded.IMAGES,
    )


@dataclass(frozen=True, slots=True, eq=False)
class OverheadFix(PoseFix):
    """Where the camera over the table sees one mock-up; the stamp is the middle of the exposure.

    Attributes:
        circles: Number of circles used.
        whole_circles: How many of them were seen whole.
        misfit_m: RMS distance between the circles and the mock-up's pattern.
        reason: Empty, or why there is no fix.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/OverheadFix"
    TOPIC: ClassVar = Topic("overhead_fix", 10, Rank.SENSOR)
    circles: U16
    whole_circles: U16
    misfit_m: F64
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class FixComparison(Message):
    """One star fix against one overhead fix; the stamp is the star fix's exposure.

    Attributes:
        apart_s: Exposure of the overhead fix after that of the star fix.
        difference: Star fix minus overhead fix, carried to one moment: x, y (m), heading (rad).
        sigma: Standard deviations of the difference: x, y (m), heading (rad).
        nis: Normalised difference squared, 3 degrees of freedom.
        pairs: Compared lately; the following speak of them.
        mean_difference: As ``difference``.
        mean_nis: 3 where both sources are as good as they say.
        verdict: ``too few``, ``agree`` or ``disagree``.
        reason: What they disagree on, in words; empty otherwise.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FixComparison"
    TOPIC: ClassVar = Topic("fix_comparison", 1.5)
    apart_s: F64
    difference: Float64x3
    sigma: Float64x3
    nis: F64
    pairs: U16
    mean_difference: Float64x3
    mean_nis: F64
    verdict: Text
    reason: Text
