"""A motion-capture system aligned to the table step by step, by flights that another source sees, too."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from calibration.guided_steps import GuidedSteps
from calibration.live_curve import LiveCurve
from calibration.manoeuvres import tour
from calibration.motion_capture.alignment import Alignment, Array, align, residuals
from calibration.motion_capture.rigs_alignment import (
    AXES,
    RigsAlignment,
    heading_drawing,
    places_drawing,
    rms_quantities,
)
from calibration.motion_capture.seen_by_both import SeenByBoth, pairs_of
from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Quantity, quantity_lines
from calibration.stepped_guide import SteppedGuide
from groundstation.declarations.fix import PoseFix
from groundstation.declarations.guide import Advice, Drawing, Goal, Step
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.motion_capture.capture_frame import CaptureFrame
from groundstation.parts.motion_capture.messages import CapturedPose
from groundstation.parts.motion_capture.sections import (
    MotionCaptureOfRig,
    MotionCaptureOfVehicle,
)
from groundstation.parts.overhead.messages import OverheadFix
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.stars.messages import StarFix

CHECK = "check"
STEPS: tuple[Step, ...] = (
    Step(
        "move",
        "Move the mock-up over the table and turn it, by hand or flying, where both systems see it.",
        False,
        (
            Goal("pairs", 150.0, "poses", is_amount=True),
            Goal("travelled_m", 2.0, "m", is_amount=True),
            Goal("turned_rad", 6.0, "rad", is_amount=True),
            Goal("origin_sigma_m", 1e-3, "m"),
            Goal("pivot_sigma_m", 1e-3, "m"),
            Goal("yaw_sigma_rad", 1e-3, "rad"),
        ),
        240.0,
    ),
    Step(
        CHECK,
        "Go on moving and turning it elsewhere: this part is kept apart, and judges the result.",
        False,
        (
            Goal("checked", 100.0, "poses", is_amount=True),
            Goal("travelled_m", 1.0, "m", is_amount=True),
            Goal("turned_rad", 3.0, "rad", is_amount=True),
        ),
        180.0,
    ),
)
EVERY_S = 7.0
JUDGED_EVERY_S = 3.0
REFERENCE_SIGMA = (0.0003, 0.0003)
"""Of a reference, which states none: m, rad."""
SOURCES: Mapping[str, type[Message]] = {
    "stars": StarFix,
    "overhead": OverheadFix,
    "reference": ReferenceState,
}
"""What the system can be laid beside, the best first."""


class GuidedAlignment(SteppedGuide):
    """One alignment.

    Args:
        rig: Of the run.
        vehicle: Whose rigid body is seen.
        source: Of `SOURCES`.
    """

    def __init__(self, rig: Rig, vehicle: str, source: str) -> None:
        manoeuvres = {"move": tour, CHECK: tour}
        super().__init__(GuidedSteps(vehicle, rig.table.keep_in(), STEPS, manoeuvres, EVERY_S))
        self._vehicle, self._source = vehicle, source
        self._rigs = RigsAlignment.of(rig, vehicle)
        self._system = self._rigs.system
        self._body_name = self._rigs.body.body or vehicle
        self._flat = CaptureFrame(self._system.up, (0.0, 0.0, 0.0), 0.0)
        self.kinds: tuple[type[Message], ...] = (CapturedPose, SOURCES[source], *GuidedSteps.kinds)
        self._both = SeenByBoth((self._system.sigma_xy_m, self._system.sigma_heading_rad))
        self._fitted: list[Array] = []
        self._checked: list[Array] = []
        self._now: Alignment | None = None
        self._judged_s = -math.inf
        self._places = [
            LiveCurve("where the other source sees it", "dots"),
            LiveCurve("motion capture", "crosses"),
        ]
        self._off = [LiveCurve(f"{axis}, {unit}") for axis, _, unit in AXES]

    @property
    def _is_aside(self) -> bool:
        return self.steps.name == CHECK

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message of the vehicle or of the system."""
        del now_ns
        match message:
            case CapturedPose():
                self._take_seen(message)
            case VehicleState() if message.vehicle == self._vehicle:
                velocity = np.array([*message.velocity_table_m_s, message.rate_rad_s])
                self._both.add_velocity(message.stamp_ns, velocity)
            case ReferenceState() if message.vehicle == self._vehicle:
                pose = np.array([*message.position_table_m, message.heading_rad])
                self._both.add_pose(message.stamp_ns, pose, REFERENCE_SIGMA, self._is_aside)
            case PoseFix(fix=True) if message.vehicle == self._vehicle:
                pose = np.array([message.x_m, message.y_m, message.heading_rad])
                xy_m2 = 0.5 * (message.covariance[0] + message.covariance[4])
                sigma = (math.sqrt(xy_m2), math.sqrt(message.covariance[8]))
                self._both.add_pose(message.stamp_ns, pose, sigma, self._is_aside)
        if message.vehicle == self._vehicle:
            self.steps.take(message)
        for stamp_ns, row, is_aside in self._both.matched():
            (self._checked if is_aside else self._fitted).append(row)
            self._draw(row, stamp_ns)

    def advice(self, now_s: float) -> Advice:
        """Return what to do now."""
        if now_s - self._judged_s >= JUDGED_EVERY_S and self.steps.name != CHECK:
            self._judged_s = now_s
            self._judge()
        return super().advice(now_s)

    def pictures(self) -> Sequence[Drawing]:
        """Return where both see it, and how far they are apart with the best alignment by now."""
        return (
            Drawing("Where it was seen", "x, m", "y, m", [c.curve() for c in self._places], is_to_scale=True),
            Drawing(
                "Motion capture less the other source, aligned as far as known",
                "time, s",
                "mm, deg",
                [c.curve() for c in self._off],
            ),
        )

    def hindrance(self) -> str:
        """Return why it cannot begin yet; empty if it can."""
        unknown = super().hindrance()
        if unknown:
            return unknown
        if not self._both.is_seen:
            return f"motion capture does not report the rigid body {self._body_name!r}."
        if not self._both.has_poses:
            return f"no pose of {self._vehicle} is received from the other source ({self._source})."
        return ""

    def outcome(self) -> Outcome:
        """Return the rig's keys of the system and of the rigid body, tried on what was set aside.

        Raises:
            CalibrationRefusedError: Too little was seen by both.
        """
        fitted = pairs_of(self._fitted)
        found = align(fitted)
        quantities = self._rigs.quantities(found)
        verification, warnings, drawings = self._verified(found.value)
        left = np.sqrt((residuals(found.value, fitted) ** 2).mean(axis=0))
        return Outcome(
            title=f"Motion capture beside {self._source}, {self._vehicle}",
            summary="\n".join([*quantity_lines(quantities), *self._rigs.lines(found.value)]),
            quantities=quantities,
            residual=rms_quantities(left),
            notes={
                "source": self._source,
                "poses": len(fitted),
                "chi_square_ratio": found.chi_square_ratio,
                "rig": self._rigs.lines(found.value),
                **{f"step_{step}": outcome for step, outcome in self.outcomes.items()},
            },
            warnings=warnings,
            verification=verification,
            verified_by=f"{len(self._checked)} poses set aside, beside {self._source}"
            if verification
            else "",
            drawings=drawings,
        )

    def _take_seen(self, message: CapturedPose) -> None:
        if message.body != self._body_name or not message.is_tracked:
            return
        try:
            pose = self._flat.pose(
                message.position_capture_m, message.quaternion_xyzw, (0.0, 0.0), 0.0, self._system.up
            )
        except ValueError:
            return  # a quaternion that is none is no pose
        exposure_ns = message.stamp_ns - round(self._system.delay_s * 1e9)
        self._both.add_seen(exposure_ns, np.array([pose.x_m, pose.y_m, pose.heading_rad]))

    def _draw(self, row: Array, stamp_ns: int) -> None:
        value = self._rigs.value() if self._now is None else self._now.value
        one = pairs_of([row])
        off = residuals(value, one)[0]
        self._places[0].add(float(row[3]), float(row[4]))
        self._places[1].add(float(row[3] + off[0]), float(row[4] + off[1]))
        for curve, each, (_, factor, _) in zip(self._off, off, AXES, strict=True):
            curve.add(stamp_ns * 1e-9, factor * float(each))

    def _judge(self) -> None:
        try:
            self._now = align(pairs_of(self._fitted))
        except CalibrationRefusedError:
            self._now = None

    def known(self) -> dict[str, float]:
        """Return the quantities of the goals."""
        known = {"pairs": float(len(self._fitted)), "checked": float(len(self._checked))}
        if self._now is None:
            return known
        sigma = self._now.sigma.tolist()
        return known | {
            "origin_sigma_m": max(sigma[0], sigma[1]),
            "yaw_sigma_rad": sigma[2],
            "pivot_sigma_m": max(sigma[3], sigma[4]),
        }

    def _verified(self, value: Array) -> tuple[dict[str, Quantity], tuple[str, ...], tuple[Drawing, ...]]:
        if not self._checked:
            return {}, ("it is not verified: nothing was seen by both after the fit",), ()
        pairs = pairs_of(self._checked)
        after, before = residuals(value, pairs), residuals(self._rigs.value(), pairs)
        numbers = rms_quantities(np.sqrt((after**2).mean(axis=0)))
        numbers |= {
            f"{name}_as_the_rig_has_it": number
            for name, number in rms_quantities(np.sqrt((before**2).mean(axis=0))).items()
        }
        ratio = float(((after / pairs.sigma[:, [0, 0, 1]]) ** 2).mean())
        numbers["chi_square_ratio"] = Quantity(ratio, math.sqrt(2.0 / after.size), "1")
        warnings = (
            (f"the poses set aside contradict it: {ratio:.1f} squared sigmas each, 1 is expected",)
            if ratio > 4.0
            else ()
        )
        return (
            numbers,
            warnings,
            (places_drawing(before, after), heading_drawing(pairs, before, after)),
        )


class AlignmentWizard:
    """Makes guided alignments of motion capture."""

    summary = (
        "Motion capture: origin and yaw of its frame, pivot of the rigid body, delay, beside another source."
    )

    def missing(self, rig: Rig, vehicle: str) -> str:
        """Return what the rig lacks."""
        system = rig.section(MotionCaptureOfRig).motion_capture
        if system is None or rig.vehicle(vehicle, MotionCaptureOfVehicle).motion_capture is None:
            return "it has no motion capture"
        if not _sources(rig, vehicle):
            return "motion capture has no other source beside it: stars, the overhead camera, or a reference"
        return ""

    def begin(self, rig: Rig, vehicle: str) -> GuidedAlignment:
        """Begin to align the system by a vehicle."""
        return GuidedAlignment(rig, vehicle, _sources(rig, vehicle)[0])


def _sources(rig: Rig, vehicle: str) -> list[str]:
    """What else sees the vehicle."""
    found = [
        name
        for name, source in rig.tables.fix_sources.items()
        if name in SOURCES and source.condition(rig, vehicle)
    ]
    if getattr(rig.vehicles[vehicle], "reference", None) is not None:
        found.append("reference")
    return sorted(found, key=list(SOURCES).index)


WIZARD = AlignmentWizard()
