"""The IMU of a running vehicle calibrated step by step: rest, turns, flights, until there is enough data."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

from calibration.guidance import Advice, Goal, GuidedSequence, Step
from calibration.imu.joint import constants, widened
from calibration.outcome import Outcome
from calibration.result import quantity_lines
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
from groundstation.parts.valves.messages import ValveStatus

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
TURN_DEG = 120.0
ROUND_TRIP = ((0.3, 0.0, 0.0), (-0.3, 0.2, math.pi / 2), (0.2, -0.3, math.pi), (0.0, 0.3, -math.pi / 2))
"""Where the vehicle is sent in the last step, from where it hovers: m, m, rad."""
LONGEST_STEP_S = 0.1
"""More between two samples is a hole, not rest."""


class GuidedImu:
    """One guided calibration: a filter of its own, and what the vehicle has done so far.

    Args:
        rig: Of the run.
        vehicle: Which one.
    """

    kinds: ClassVar = (Imu, StarFix, OverheadFix, ValveStatus)

    def __init__(self, rig: Rig, vehicle: str) -> None:
        self._vehicle = vehicle
        self._smoother = OfflineSmoother(widened(rig_noise(rig, vehicle)))
        self._node = fusion_node(rig, vehicle, self._smoother)
        self._sequence = GuidedSequence(STEPS)
        self._advice: Advice | None = None
        self._floats = True
        self._stamp_ns = 0
        self._rest_s = self._turned_rad = self._travelled_m = 0.0
        self._pose: tuple[float, float, float] | None = None
        self._step, self._sent, self._next_s = "", 0, 0.0
        self._home = (0.0, 0.0, 0.0)

    @property
    def outcomes(self) -> dict[str, str]:
        """How each step ended."""
        return self._sequence.outcomes

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message of the vehicle."""
        if isinstance(message, ValveStatus):
            self._floats = message.floating
        if isinstance(message, Imu):
            if not self._floats and self._stamp_ns:
                self._rest_s += min(LONGEST_STEP_S, (message.stamp_ns - self._stamp_ns) * 1e-9)
            self._stamp_ns = message.stamp_ns
        for _ in self._node.receive(message, now_ns):
            pass
        state = self._smoother.state()
        if isinstance(message, StarFix) and state is not None:
            pose = (state.x_m, state.y_m, state.heading_rad)
            if self._pose is not None:
                self._travelled_m += math.hypot(pose[0] - self._pose[0], pose[1] - self._pose[1])
                self._turned_rad += abs(pose[2] - self._pose[2])
            self._pose = pose

    def advice(self, now_s: float) -> Advice:
        """Return what to do now."""
        self._advice = self._sequence.update(now_s, self._known())
        return self._advice

    def requests(self, now_s: float) -> Iterator[Wish]:
        """Yield what the step of the last advice wants the vehicle to do, now and then."""
        step = None if self._advice is None else self._advice.step
        if step is None:
            return
        if step.name != self._step:
            self._step, self._sent, self._home = step.name, 0, self._pose or (0.0, 0.0, 0.0)
            for action in (
                ("disarm", "float_off") if step.is_rest else ("float_on", "release", "arm", "resume")
            ):
                yield action, {}
            self._next_s = now_s + SETTLE_S
        if step.is_rest or now_s < self._next_s:
            return
        self._next_s = now_s + GO_TO_EVERY_S
        x, y, heading = self._home
        if step.name == "turn":
            # three turns forth and three back
            number = self._sent % 6
            heading += math.radians(TURN_DEG) * (number + 1 if number < 3 else 5 - number)
        else:
            dx, dy, turn = ROUND_TRIP[self._sent % len(ROUND_TRIP)]
            x, y, heading = x + dx, y + dy, heading + turn
        self._sent += 1
        yield "go_to", {"x_m": x, "y_m": y, "heading_rad": math.remainder(heading, math.tau)}

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

    def _known(self) -> dict[str, float]:
        """Return the quantities of the goals."""
        amounts = {"rest_s": self._rest_s, "turned_rad": self._turned_rad, "travelled_m": self._travelled_m}
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
