"""The IMU of a running vehicle calibrated step by step: rest, turns, flights, and a flight to verify by."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from calibration.guided_steps import GuidedSteps
from calibration.imu.carried_check import GAP_S, Carried, Received, carried, held, held_before, warmed
from calibration.imu.joint import constants, widened
from calibration.live_curve import LiveCurve
from calibration.manoeuvres import Pose, push, turn
from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Quantity, quantity_lines
from calibration.stepped_guide import SteppedGuide
from groundstation.declarations.fix import PoseFix
from groundstation.declarations.guide import Curve, Drawing, Goal, Mark, Step
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.fusion import error_state as es
from groundstation.fusion.offline import OfflineSmoother
from groundstation.parts.fusion.estimation import rig_noise
from groundstation.parts.fusion.messages import FixAccount
from groundstation.parts.fusion.part import fusion_node
from groundstation.parts.fusion.sections import fused_sources
from groundstation.parts.imu.messages import Imu

CHECK = "check"
STEPS: tuple[Step, ...] = (
    Step(
        "rest",
        "Land the vehicle (float air off) and keep your hands off table and vehicle.",
        True,
        (Goal("rest_s", 20.0, "s", is_amount=True), Goal("gyro_bias_sigma_rad_s", 3e-4, "rad/s")),
        120.0,
    ),
    Step(
        "turn",
        "Float, and turn the vehicle by more than two full turns, some one way and some the other.",
        False,
        (
            Goal("turned_rad", 12.6, "rad", is_amount=True),
            Goal("gyro_scale_sigma", 2e-3, "1"),
            Goal("lever_sigma_m", 2e-3, "m"),
        ),
        240.0,
    ),
    Step(
        "push",
        "Fly to and fro along both axes of the table, with the vehicle turned by a quarter in between.",
        False,
        (
            Goal("travelled_m", 2.0, "m", is_amount=True),
            Goal("slope_sigma_m_s2", 4e-4, "m/s^2"),
            Goal("acc_scale_sigma", 2.5e-2, "1"),
        ),
        240.0,
    ),
    Step(
        CHECK,
        "Go on flying to and fro and turning: this part is kept apart, and judges the result.",
        False,
        (
            Goal("checked_s", 40.0, "s", is_amount=True),
            Goal("travelled_m", 1.0, "m", is_amount=True),
            Goal("turned_rad", 3.0, "rad", is_amount=True),
        ),
        180.0,
    ),
)
AXES = (("x", 1e3, "mm"), ("y", 1e3, "mm"), ("heading", math.degrees(1.0), "deg"))
SWING_RAD = 0.75
WORST_NIS = 9.0
"""Three times what chance gives: the constants, or their sigmas, do not hold for the flight set aside."""


def check(number: int, home: Pose) -> Pose:
    """The goal of a number: to and fro over other places, turning one way and back.

    A scale that is off looks like a bias as long as it turns one way.
    """
    x_m, y_m, _ = push(number + 2, home)
    return x_m, y_m, home[2] + (SWING_RAD if number % 2 == 0 else -SWING_RAD)


MANOEUVRES = {"turn": turn, "push": push, CHECK: check}


class GuidedImu(SteppedGuide):
    """One guided calibration: a filter of its own, and what the vehicle has done so far.

    Args:
        rig: Of the run.
        vehicle: Which one.
    """

    def __init__(self, rig: Rig, vehicle: str) -> None:
        super().__init__(GuidedSteps(vehicle, rig.table.keep_in(), STEPS, MANOEUVRES))
        self._rig, self._vehicle = rig, vehicle
        sources = rig.tables.fix_sources
        fixes: list[type[Message]] = [sources[name].payload for name in fused_sources(rig, vehicle)]
        self._fed: tuple[type[Message], ...] = (Imu, *fixes)
        self.kinds: tuple[type[Message], ...] = (*self._fed, *GuidedSteps.kinds)
        self._smoother = OfflineSmoother(widened(rig_noise(rig, vehicle)))
        self._node = fusion_node(rig, vehicle, self._smoother)
        self._set_aside: list[Received] = []
        self._checked_s = 0.0
        self._first_c = self._check_c = math.nan
        self._rate = LiveCurve("turn rate, deg/s", "line", 0.1)
        self._force = [LiveCurve(f"force {axis}, 100 mm/s²", "line", 0.1) for axis in "xy"]
        self._off = [LiveCurve(f"{axis}, {unit}") for axis, _, unit in AXES]

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message of the vehicle; those of the last step are kept apart."""
        if getattr(message, "vehicle", self._vehicle) != self._vehicle:
            return
        self.steps.take(message)
        if isinstance(message, Imu):
            self._look(message)
        if self.steps.name == CHECK:
            if not isinstance(message, PoseFix) or isinstance(message, self._fed):
                self._set_aside.append((message, now_ns))
            if isinstance(message, Imu) and self.steps.floats:
                self._checked_s += message.window_s
            return
        if isinstance(message, PoseFix) and not isinstance(message, self._fed):
            return
        for answer in self._node.receive(message, now_ns):
            if isinstance(answer, FixAccount) and answer.used:
                for curve, off, (_, factor, _) in zip(self._off, answer.innovation, AXES, strict=True):
                    curve.add(answer.stamp_ns * 1e-9, factor * off)

    def pictures(self) -> Sequence[Drawing]:
        """Return the readings, and how far each fix is off what the IMU predicts."""
        return (
            Drawing("What the IMU reads", "time, s", "", [c.curve() for c in (self._rate, *self._force)]),
            Drawing("Fix less what the IMU predicts", "time, s", "mm, deg", [c.curve() for c in self._off]),
        )

    def outcome(self) -> Outcome:
        """Return every constant with its sigma, tried on the flight that was kept apart.

        Raises:
            CalibrationRefusedError: No two fixes agreed.
        """
        quantities = constants(self._smoother)
        verification, warnings, drawings = self._verified(quantities)
        return Outcome(
            title=f"IMU of {self._vehicle}, guided",
            summary="\n".join(quantity_lines(quantities)),
            quantities=quantities,
            residual={},
            notes={f"step_{step}": outcome for step, outcome in self.outcomes.items()},
            warnings=warnings,
            verification=verification,
            verified_by=f"a flight of {self._checked_s:.0f} s, carried {GAP_S:g} s from fix to fix"
            if verification
            else "",
            drawings=drawings,
        )

    def _verified(
        self, found: Mapping[str, Quantity]
    ) -> tuple[dict[str, Quantity], tuple[str, ...], tuple[Drawing, ...]]:
        noise = rig_noise(self._rig, self._vehicle)
        found = warmed(found, self._check_c - self._first_c)
        try:
            after = carried(self._rig, self._vehicle, self._set_aside, held(noise, found))
            before = carried(self._rig, self._vehicle, self._set_aside, held_before(noise, found))
        except CalibrationRefusedError as error:
            return {}, (f"it is not verified: {error}",), ()
        numbers = {
            f"{name}{ending}": Quantity(float(rms), math.nan, "rad" if name == "heading" else "m")
            for ending, each in (("", after), ("_with_the_rigs_constants", before))
            for (name, _, _), rms in zip(AXES, each.rms, strict=True)
        }
        nis = float(after.nis.mean())
        numbers["nis"] = Quantity(nis, math.sqrt(6.0 / len(after.nis)), "1")
        warnings = (
            (f"the flight set aside contradicts it: {nis:.1f} squared sigmas a fix, 3 are expected",)
            if nis > WORST_NIS
            else ()
        )
        return numbers, warnings, tuple(_drawing(k, before, after) for k in range(3))

    def _look(self, imu: Imu) -> None:
        """Keep some readings for the picture, and at which temperatures fit and check begin."""
        if math.isnan(self._first_c):
            self._first_c = imu.temperature_c
        if math.isnan(self._check_c) and self.steps.name == CHECK:
            self._check_c = imu.temperature_c
        t_s = imu.stamp_ns * 1e-9
        self._rate.add(t_s, math.degrees(imu.rate_body_rad_s))
        for curve, force in zip(self._force, imu.force_body_m_s2, strict=True):
            curve.add(t_s, 10.0 * force)

    def known(self) -> dict[str, float]:
        """Return the quantities of the goals."""
        known = {"checked_s": self._checked_s}
        if self._smoother.state() is None:
            return known
        sigma = self._smoother.sigmas().tolist()
        return known | {
            "gyro_bias_sigma_rad_s": sigma[es.GYRO_BIAS],
            "gyro_scale_sigma": sigma[es.GYRO_SCALE],
            "lever_sigma_m": max(sigma[es.LEVER_X], sigma[es.LEVER_Y]),
            "slope_sigma_m_s2": max(sigma[es.SLOPE_X], sigma[es.SLOPE_Y]),
            "acc_scale_sigma": max(sigma[es.ACC_MATRIX], sigma[es.ACC_MATRIX + 3]),
        }


def _drawing(axis: int, before: Carried, after: Carried) -> Drawing:
    name, factor, unit = AXES[axis]
    rows: tuple[tuple[str, Carried, Mark], ...] = (
        ("with the rig's constants", before, "refused"),
        ("with the result", after, "dots"),
    )
    curves = []
    for words, each, mark in rows:
        t_s, off = each.off[:, 0] - each.off[0, 0], factor * each.off[:, axis + 1]
        curves.append(Curve(words, t_s.tolist(), off.tolist(), mark))
    return Drawing(f"Drift in {GAP_S:g} s, flight set aside: {name}", "time, s", f"{name}, {unit}", curves)


class ImuWizard:
    """Makes guided calibrations of the IMU."""

    summary = "IMU: biases, scales, lever arm and slope by rest, turns and pushes."

    def missing(self, rig: Rig, vehicle: str) -> str:
        """Nothing: each vehicle has an IMU and fixes."""
        del rig, vehicle
        return ""

    def begin(self, rig: Rig, vehicle: str) -> GuidedImu:
        """Begin to calibrate a vehicle."""
        return GuidedImu(rig, vehicle)


WIZARD = ImuWizard()
