"""The IMU of a running vehicle calibrated step by step: rest, turns, flights, until there is enough data."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

from calibration.guidance import Advice, Goal, GuidedSequence, Step
from calibration.imu.joint import constants, widened
from calibration.imu.manoeuvres import Pose, inside, push, turn
from calibration.outcome import Outcome
from calibration.result import quantity_lines
from calibration.vehicle_watch import VehicleWatch
from calibration.wizards import Wish
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.fusion import error_state as es
from groundstation.fusion.offline import OfflineSmoother
from groundstation.parts.fusion.estimation import rig_noise
from groundstation.parts.fusion.part import fusion_node
from groundstation.parts.imu.messages import Imu
from groundstation.parts.overhead.messages import OverheadFix
from groundstation.parts.stars.messages import StarFix

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
)
GO_TO_EVERY_S = 9.0
SETTLE_S = 2.0
MANOEUVRES = {"turn": turn, "push": push}


class GuidedImu:
    """One guided calibration: a filter of its own, and what the vehicle has done so far.

    Args:
        rig: Of the run.
        vehicle: Which one.
    """

    kinds: ClassVar = (Imu, StarFix, OverheadFix, *VehicleWatch.kinds)

    def __init__(self, rig: Rig, vehicle: str) -> None:
        self._vehicle = vehicle
        self._smoother = OfflineSmoother(widened(rig_noise(rig, vehicle)))
        self._node = fusion_node(rig, vehicle, self._smoother)
        self._sequence = GuidedSequence(STEPS)
        self._keep_in = rig.table.keep_in()
        self._watch = VehicleWatch(vehicle)
        self._advice: Advice | None = None
        self._began_s = 0.0
        self._turned_rad = self._travelled_m = 0.0
        self._pose: Pose | None = None
        self._refusal = ""
        self._is_asked = self._is_given = self._is_rest = False
        self._sent, self._next_s = 0, math.inf
        self._home: Pose = (0.0, 0.0, 0.0)

    @property
    def outcomes(self) -> dict[str, str]:
        """How each step ended."""
        return self._sequence.outcomes

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message of the vehicle."""
        self._watch.take(message)
        for _ in self._node.receive(message, now_ns):
            pass
        state = self._smoother.state()
        if isinstance(message, StarFix) and state is not None:
            pose = (state.x_m, state.y_m, state.heading_rad)
            if self._pose is not None and self._watch.floats:
                self._travelled_m += math.hypot(pose[0] - self._pose[0], pose[1] - self._pose[1])
                self._turned_rad += abs(pose[2] - self._pose[2])
            self._pose = pose

    def advice(self, now_s: float) -> Advice:
        """Return what to do now."""
        known = self._known(now_s)
        if self._refusal:
            advice = self._sequence.give_up(now_s, known, self._refusal)
        else:
            advice = self._sequence.update(now_s, known)
        if advice.is_new:
            self._begin_step(now_s, is_rest=advice.step is not None and advice.step.is_rest)
        waits = "" if advice.step is None or advice.step.is_rest else self._watch.waits()
        self._advice = replace(advice, note=waits)
        return self._advice

    def _begin_step(self, now_s: float, *, is_rest: bool) -> None:
        """Forget the step before, but not that it has been given what this one needs as well."""
        self._is_given = self._is_given and self._is_rest == is_rest
        self._is_asked, self._is_rest, self._refusal = self._is_given, is_rest, ""
        self._began_s, self._next_s, self._sent = now_s, math.inf, 0

    def hindrance(self) -> str:
        """Return why the calibration cannot begin yet; empty if it can."""
        return self._watch.unknown()

    def trouble(self) -> str:
        """Return why the calibration ends early: somebody else has taken the vehicle; empty if nobody has."""
        return self._watch.taken(is_rest=self._is_rest) if self._is_given else self._watch.stopped()

    def answer(self, action: str, reason: str) -> None:
        """Note what became of a request; a refusal, with its reason, ends the step."""
        if reason:
            self._refusal = f"{action} was refused: {reason}"
        elif action in ("land", "fly"):
            self._is_given = True

    def requests(self, now_s: float) -> Iterator[Wish]:
        """Yield what the step of the last advice wants the vehicle to do, now and then."""
        step = None if self._advice is None else self._advice.step
        if step is None or self._refusal:
            return
        if not self._is_asked:
            self._is_asked = step.is_rest or not self._watch.is_on_its_way_down
            if self._is_asked:
                yield "land" if step.is_rest else "fly", {}
            return
        if step.is_rest or not self._is_given or self._watch.waits():
            return
        if self._next_s == math.inf:
            self._home, self._next_s = self._pose or self._home, now_s + SETTLE_S
        if now_s < self._next_s:
            return
        self._next_s = now_s + GO_TO_EVERY_S
        x_m, y_m, heading_rad = inside(MANOEUVRES[step.name](self._sent, self._home), self._keep_in)
        self._sent += 1
        yield "go_to", {"x_m": x_m, "y_m": y_m, "heading_rad": math.remainder(heading_rad, math.tau)}

    def outcome(self) -> Outcome:
        """Return every constant with its sigma.

        Raises:
            CalibrationRefusedError: No two fixes agreed.
        """
        quantities = constants(self._smoother)
        return Outcome(
            title=f"IMU of {self._vehicle}, guided",
            summary="\n".join(quantity_lines(quantities)),
            quantities=quantities,
            residual={},
            notes={f"step_{step}": outcome for step, outcome in self._sequence.outcomes.items()},
        )

    def _known(self, now_s: float) -> dict[str, float]:
        """Return the quantities of the goals; of a rest, the part without a break that lies in this step."""
        rest_s = min(self._watch.rest_s, now_s - self._began_s) if self._is_rest else 0.0
        amounts = {"rest_s": rest_s, "turned_rad": self._turned_rad, "travelled_m": self._travelled_m}
        if self._smoother.state() is None:
            return amounts
        sigma = self._smoother.sigmas().tolist()
        return amounts | {
            "gyro_bias_sigma_rad_s": sigma[es.GYRO_BIAS],
            "gyro_scale_sigma": sigma[es.GYRO_SCALE],
            "lever_sigma_m": max(sigma[es.LEVER_X], sigma[es.LEVER_Y]),
            "slope_sigma_m_s2": max(sigma[es.SLOPE_X], sigma[es.SLOPE_Y]),
            "acc_scale_sigma": max(sigma[es.ACC_MATRIX], sigma[es.ACC_MATRIX + 3]),
        }


class ImuWizard:
    """Makes guided calibrations of the IMU."""

    summary = "IMU: biases, scales, lever arm and slope by rest, turns and pushes."

    def begin(self, rig: Rig, vehicle: str) -> GuidedImu:
        """Begin to calibrate a vehicle."""
        return GuidedImu(rig, vehicle)


WIZARD = ImuWizard()
