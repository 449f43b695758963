"""An alignment of motion capture in the words of a rig file, and what poses set aside show of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from calibration.motion_capture.alignment import Alignment, Array, Pairs
from calibration.result import Quantity
from groundstation.declarations.guide import Curve, Drawing, Mark
from groundstation.declarations.rig import Rig
from groundstation.frames import wrap_angle
from groundstation.parts.motion_capture.sections import (
    CapturedBodySection,
    MotionCaptureOfRig,
    MotionCaptureOfVehicle,
    MotionCaptureSection,
)

AXES = (("x", 1e3, "mm"), ("y", 1e3, "mm"), ("heading", math.degrees(1.0), "deg"))


@dataclass(frozen=True, slots=True)
class RigsAlignment:
    """What a rig states, and how a result is written into it.

    Attributes:
        vehicle: Whose rigid body.
        system: Of the rig.
        body: Of the vehicle.
    """

    vehicle: str
    system: MotionCaptureSection
    body: CapturedBodySection

    @classmethod
    def of(cls, rig: Rig, vehicle: str) -> RigsAlignment:
        """Of a rig that has motion capture of the vehicle."""
        system = rig.section(MotionCaptureOfRig).motion_capture
        body = rig.vehicle(vehicle, MotionCaptureOfVehicle).motion_capture
        assert system is not None
        assert body is not None
        return cls(vehicle, system, body)

    def value(self) -> Array:
        """As the rig has it."""
        x_m, y_m, _ = self.system.origin_table_m
        return np.array(
            [
                x_m,
                y_m,
                math.radians(self.system.yaw_deg),
                *self.body.pivot_body_m,
                math.radians(self.body.pivot_yaw_deg),
                0.0,
            ]
        )

    def quantities(self, found: Alignment) -> dict[str, Quantity]:
        """A result by the names of the rig's keys."""
        value, sigma = found.value.tolist(), found.sigma.tolist()
        turn = math.degrees(1.0)
        return {
            "origin_table_x": Quantity(value[0], sigma[0], "m"),
            "origin_table_y": Quantity(value[1], sigma[1], "m"),
            "yaw": Quantity(turn * wrap_angle(value[2]), turn * sigma[2], "deg"),
            "pivot_body_x": Quantity(value[3], sigma[3], "m"),
            "pivot_body_y": Quantity(value[4], sigma[4], "m"),
            "pivot_yaw": Quantity(turn * wrap_angle(value[5]), turn * sigma[5], "deg"),
            "delay": Quantity(self.system.delay_s + value[6], sigma[6], "s"),
        }

    def lines(self, value: Array) -> list[str]:
        """What belongs into the rig file."""
        z_m, turn = self.system.origin_table_m[2], math.degrees(1.0)
        return [
            f"[motion_capture] origin_table_m = [{value[0]:.5f}, {value[1]:.5f}, {z_m:g}]",
            f"[motion_capture] yaw_deg = {turn * wrap_angle(value[2]):.4f}",
            f"[motion_capture] delay_s = {max(0.0, self.system.delay_s + value[6]):.4f}",
            f"[vehicles.{self.vehicle}] motion_capture.pivot_body_m = [{value[3]:.5f}, {value[4]:.5f}]",
            f"[vehicles.{self.vehicle}] motion_capture.pivot_yaw_deg = {turn * wrap_angle(value[5]):.4f}",
        ]


def rms_quantities(rms: Array) -> dict[str, Quantity]:
    """Root mean squares (3,) of x, y, heading by name."""
    return {
        name: Quantity(float(each), math.nan, "rad" if name == "heading" else "m")
        for (name, _, _), each in zip(AXES, rms, strict=True)
    }


def places_drawing(before: Array, after: Array) -> Drawing:
    """Residuals (n, 3) of places, without and with the alignment."""
    rows: tuple[tuple[str, Array, Mark], ...] = (
        ("as the rig has it", before, "refused"),
        ("aligned", after, "dots"),
    )
    curves = [
        Curve(name, (1e3 * off[:, 0]).tolist(), (1e3 * off[:, 1]).tolist(), mark) for name, off, mark in rows
    ]
    return Drawing("Poses set aside: how far off the place", "x, mm", "y, mm", curves, is_to_scale=True)


def heading_drawing(pairs: Pairs, before: Array, after: Array) -> Drawing:
    """Residuals (n, 3) of headings by heading, without and with the alignment."""
    heading = np.degrees(pairs.pose[:, 2]).tolist()
    rows: tuple[tuple[str, Array, Mark], ...] = (
        ("as the rig has it", before, "refused"),
        ("aligned", after, "dots"),
    )
    curves = [Curve(name, heading, np.degrees(off[:, 2]).tolist(), mark) for name, off, mark in rows]
    return Drawing("Poses set aside: how far off the heading", "heading, deg", "off, deg", curves)
