"""Between the star tracker's mathematics and its messages."""

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.frames import wrap_angle
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.stars.messages import SkyChange, StarFix, StarMatches, StarSpots
from groundstation.star_tracking import fixes, sky_change
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.picture_notes import PictureNotes


def fix_message(
    spots: StarSpots, answer: fixes.PictureFix, exposure_ns: int, stamp_sigma_s: float
) -> StarFix:
    """The pose found in a set of spots, stamped with the middle of their exposure."""
    return StarFix(
        exposure_ns,
        spots.vehicle,
        True,
        answer.x_m,
        answer.y_m,
        wrap_angle(answer.heading_rad),
        tuple(answer.covariance.ravel().tolist()),
        stamp_sigma_s,
        answer.stars,
        answer.mode.value,
        "",
    )


def refusal_message(spots: StarSpots, reason: str, exposure_ns: int, stamp_sigma_s: float) -> StarFix:
    """No pose, and why."""
    nowhere, nothing = (math.nan,) * 3, (math.nan,) * 9
    mode = fixes.Mode.LOST_IN_SPACE.value
    return StarFix(exposure_ns, spots.vehicle, False, *nowhere, nothing, stamp_sigma_s, 0, mode, reason)


def change_message(spots: StarSpots, found: sky_change.SkyChange, exposure_ns: int) -> SkyChange:
    """A finding of the watchdog, stamped by the exposure that decided."""
    return SkyChange(
        exposure_ns,
        spots.vehicle,
        found.change.value,
        found.star,
        found.x_m,
        found.y_m,
        found.covariance_m2,
        found.sightings,
    )


def change_of(message: SkyChange) -> sky_change.SkyChange:
    """What ``change_message`` was made from."""
    return sky_change.SkyChange(
        sky_change.Change(message.change),
        message.star,
        message.x_m,
        message.y_m,
        message.place_covariance,
        message.sightings,
    )


def matches_message(spots: StarSpots, notes: PictureNotes, reason: str) -> StarMatches:
    """Which light is what in one picture."""
    spot_px, star_px = notes.spot_px.astype(np.float32), notes.star_px.astype(np.float32)
    return StarMatches(
        spots.stamp_ns,
        spots.vehicle,
        reason,
        notes.basis,
        *notes.pose,
        np.ascontiguousarray(spot_px[:, 0]),
        np.ascontiguousarray(spot_px[:, 1]),
        notes.kind.tobytes(),
        notes.stars,
        np.ascontiguousarray(star_px[:, 0]),
        np.ascontiguousarray(star_px[:, 1]),
        notes.spot_of_star.tobytes(),
    )


def notes_of(message: StarMatches) -> PictureNotes:
    """What ``matches_message`` was made from, in single precision."""
    return PictureNotes(
        np.stack((message.u_px, message.v_px), axis=1).astype(np.float64),
        np.frombuffer(message.kind, np.uint8),
        message.stars,
        np.stack((message.star_u_px, message.star_v_px), axis=1).astype(np.float64),
        np.frombuffer(message.spot_of_star, np.uint8),
        message.basis,
        (message.x_m, message.y_m, message.heading_rad),
    )


def belief_of(state: VehicleState, stamp_sigma_s: float) -> fixes.PosePrior:
    """What the filter believes of the pose at the exposure, whose stamp is uncertain too."""
    motion = np.array([*state.velocity_table_m_s, state.rate_rad_s])
    covariance = np.diag(np.square(state.pose_sigma)) + stamp_sigma_s**2 * np.outer(motion, motion)
    return fixes.PosePrior(*state.position_table_m, state.heading_rad, covariance)


def motion_of(state: VehicleState) -> fixes.BodyMotion:
    """The velocity during the exposure."""
    return fixes.BodyMotion(*state.velocity_table_m_s, state.rate_rad_s)


def spots_of(message: StarSpots) -> Spots:
    """The light spots of a message, in double precision."""

    def double(values: NDArray[np.float32], *shape: int) -> NDArray[np.float64]:
        return values.astype(np.float64).reshape(shape)

    return Spots(
        double(message.u_px, -1),
        double(message.v_px, -1),
        double(message.flux_dn, -1),
        double(message.covariance_px2, -1, 3),
        double(message.elongation, -1),
        double(message.streak_px, -1, 2),
        message.background_dn,
        message.noise_dn,
        message.hot_pixels,
        message.cut_by_edge,
        message.flooded,
    )
