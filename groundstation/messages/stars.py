"""What the star camera sees, from the frame to the fix."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.messages.base import (
    F64,
    I64,
    PACKAGE,
    U8,
    U16,
    U32,
    Bool,
    Bytes,
    Float32Array,
    Float64x9,
    Message,
    Text,
)


@dataclass(frozen=True, slots=True, eq=False)
class StarImage(Message):
    """One grey frame of the star camera; the stamp is the middle of the exposure."""

    ROS_TYPE: ClassVar[str] = "sensor_msgs/msg/Image"
    height: U32
    width: U32
    encoding: Text
    is_bigendian: U8
    step: U32
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class StarSpots(Message):
    """Spots of light found in one frame, brightest first; stamp and vehicle are the frame's.

    Attributes:
        arrival_ns: When the frame reached the node that looked into it.
        u_px: Column of each centre, pixel (0, 0) is the centre of the top-left pixel.
        v_px: Row of each centre.
        flux_dn: Light above the background.
        covariance_px2: uu, uv, vv of each centre, one after the other.
        elongation: Ratio of the spot's principal axes, 1 is round.
        streak_px: Motion streak du, dv of each spot, one after the other.
        background_dn: Median grey level of the frame.
        noise_dn: Standard deviation of the background.
        hot_pixels: Groups dropped as hot pixels.
        cut_by_edge: Spots dropped at the frame's edge.
        flooded: More light than a sky of stars can have.
        reason: Empty, or why the frame cannot be looked into.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/StarSpots"
    arrival_ns: I64
    u_px: Float32Array
    v_px: Float32Array
    flux_dn: Float32Array
    covariance_px2: Float32Array
    elongation: Float32Array
    streak_px: Float32Array
    background_dn: F64
    noise_dn: F64
    hot_pixels: U16
    cut_by_edge: U16
    flooded: Bool
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class StarFix(Message):
    """The answer of the star tracker to one frame; the stamp is the middle of the exposure.

    Attributes:
        fix: Whether there is a pose; without one the pose is NaN and ``reason`` says why.
        x_m: Body origin in the table frame.
        y_m: Body origin in the table frame.
        heading_rad: Heading in [-pi, pi).
        covariance: Row-major 3 x 3 of (x, y, heading) in m and rad.
        stamp_sigma_s: Standard deviation of the stamp against the host's clock.
        stars: Number of stars used.
        mode: How it was found: ``lost-in-space``, ``tracking`` or ``external``.
        reason: Empty, or why there is no fix.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/StarFix"
    fix: Bool
    x_m: F64
    y_m: F64
    heading_rad: F64
    covariance: Float64x9
    stamp_sigma_s: F64
    stars: U16
    mode: Text
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class FixBytes(Message):
    """A read of an external pose stream that serves as star fixes."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FixBytes"
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class SkyChange(Message):
    """A star that died, revived, moved or appeared; the stamp is the exposure that decided.

    Attributes:
        change: ``died``, ``revived``, ``moved`` or ``appeared``.
        star: Id of the catalogue, empty for a light that appeared.
        x_m: Where it is seen now, or was, in the table frame.
        y_m: Where it is seen now, or was, in the table frame.
        place_std: Standard deviation of that place per axis, m.
        sightings: How many sightings speak for it.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/SkyChange"
    change: Text
    star: Text
    x_m: F64
    y_m: F64
    place_std: F64
    sightings: U32
