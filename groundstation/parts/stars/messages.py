"""What the star camera sees, from the frame to the fix."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.camera_image import CameraImage
from groundstation.declarations.fix import PoseFix
from groundstation.declarations.message import (
    F64,
    I64,
    PACKAGE,
    U16,
    U32,
    Bool,
    Bytes,
    Float32Array,
    Float64x3,
    Message,
    Text,
    TextSequence,
)
from groundstation.declarations.topic import Delivery, Rank, Recorded, Topic


@dataclass(frozen=True, slots=True, eq=False)
class StarImage(CameraImage):
    """One grey picture of the star camera; the stamp is its arrival."""

    TOPIC: ClassVar = Topic("star_image", 15, Rank.SENSOR, delivery=Delivery.NEWEST, recorded=Recorded.IMAGES)


@dataclass(frozen=True, slots=True, eq=False)
class PictureTrouble(Message):
    """A picture that is none of its moment: it was delivered before, or is put together from two.

    Published only of such pictures, with their stamp, before their spots.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/PictureTrouble"
    TOPIC: ClassVar = Topic("picture_trouble", rank=Rank.SENSOR)
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class StarSpots(Message):
    """Spots of light found in one picture, brightest first; stamps and vehicle are the picture's.

    Attributes:
        device_stamp_ns: When the camera's driver had the picture; 0 where it does not state it.
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
    TOPIC: ClassVar = Topic("star_spots", 15, Rank.SENSOR, recorded=Recorded.SPOTS)
    device_stamp_ns: I64
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
class StarFix(PoseFix):
    """The answer of the star tracker to one picture; the stamp is the middle of the exposure.

    Attributes:
        stars: Number of stars used.
        mode: How it was found: ``lost-in-space``, ``tracking`` or ``external``.
        reason: Empty, or why there is no fix.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/StarFix"
    TOPIC: ClassVar = Topic("star_fix", 15, Rank.SENSOR)
    stars: U16
    mode: Text
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class FixBytes(Message):
    """A read of an external pose stream that serves as star fixes."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FixBytes"
    TOPIC: ClassVar = Topic("fix_bytes", rank=Rank.SENSOR)
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class SkyChange(Message):
    """A star that died or moved or came back, or a light that appeared; stamped by the exposure that decided.

    Attributes:
        change: ``died``, ``revived``, ``moved``, ``returned``, ``appeared`` or ``vanished``.
        star: Id of the catalogue, empty for a light that is none of its stars.
        x_m: Where it is seen now, or was last, in the table frame.
        y_m: Where it is seen now, or was last, in the table frame.
        place_covariance: Covariance of that place: xx, xy, yy in m^2.
        sightings: How many sightings (of a dead star: misses) speak for it.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/SkyChange"
    TOPIC: ClassVar = Topic("sky_change")
    change: Text
    star: Text
    x_m: F64
    y_m: F64
    place_covariance: Float64x3
    sightings: U32


@dataclass(frozen=True, slots=True, eq=False)
class StarMatches(Message):
    """What the star tracker made of one picture: reported of refused ones now and then, and on request.

    Attributes:
        reason: Why there is no fix; empty for a fix.
        basis: What the stars' places rest on: ``fix``, ``guess`` (the pose that the refused search came
            nearest to), ``state`` (the filter's), or empty: then there are no stars.
        x_m: Pose of that basis, NaN without one.
        y_m: Pose of that basis.
        heading_rad: Pose of that basis.
        u_px: Column of each light spot.
        v_px: Row of each light spot.
        kind: What each is: 0 a light, 1 a star, 2 no star of the catalogue, 3 a streak.
        stars: Ids of the stars that the picture should show.
        star_u_px: Column at which each of them should be.
        star_v_px: Row at which each of them should be.
        spot_of_star: Index of the spot that each of them is, 255 for a star not seen.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/StarMatches"
    TOPIC: ClassVar = Topic("star_matches")
    reason: Text
    basis: Text
    x_m: F64
    y_m: F64
    heading_rad: F64
    u_px: Float32Array
    v_px: Float32Array
    kind: Bytes
    stars: TextSequence
    star_u_px: Float32Array
    star_v_px: Float32Array
    spot_of_star: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class StarPicture(Message):
    """The picture that a ``StarMatches`` of the same stamp speaks of, compressed without loss."""

    ROS_TYPE: ClassVar[str] = "sensor_msgs/msg/CompressedImage"
    TOPIC: ClassVar = Topic("star_picture", recorded=Recorded.SPOTS)
    format: Text
    data: Bytes
