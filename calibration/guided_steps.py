"""Steps of a guided calibration, walked through by hand or driven; what they have in common.

A guide states its table of steps and what each is flown by, and gives what it knows; this judges which step
is due, counts how far the vehicle has turned and gone, and asks for what a driven step needs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import ClassVar

from calibration.guidance import GuidedSequence
from calibration.manoeuvres import Pose, inside
from calibration.vehicle_watch import VehicleWatch
from groundstation.control.keep_in import KeepIn
from groundstation.declarations.guide import Advice, Step, Wish
from groundstation.declarations.message import Message
from groundstation.frames import wrap_angle
from groundstation.parts.fusion.messages import VehicleState
from groundstation.supervision.modes import Mode

Manoeuvre = Callable[[int, Pose], Pose]
"""The goal of a number, from where the vehicle hovered when the step began."""
GO_TO_EVERY_S = 9.0
SETTLE_S = 2.0
LOOK_EVERY_S = 0.5
"""Ways and turns are summed between poses so far apart: between nearer ones they would be noise."""


class GuidedSteps:
    """Walks a vehicle through steps.

    Args:
        vehicle: Which one.
        keep_in: The part of the table that goals stay in.
        steps: The table.
        manoeuvres: Of the steps that are flown, by their names.
        every_s: From one goal to the next.
    """

    kinds: ClassVar = VehicleWatch.kinds

    def __init__(
        self,
        vehicle: str,
        keep_in: KeepIn,
        steps: tuple[Step, ...],
        manoeuvres: Mapping[str, Manoeuvre],
        every_s: float = GO_TO_EVERY_S,
    ) -> None:
        self._keep_in, self._manoeuvres, self._every_s = keep_in, manoeuvres, every_s
        self._sequence = GuidedSequence(steps)
        self._watch = VehicleWatch(vehicle)
        self._advice: Advice | None = None
        self._began_s = 0.0
        self._turned_rad = self._travelled_m = 0.0
        self._looked_ns, self._pose = 0, (0.0, 0.0, 0.0)
        self._refusal = ""
        self._is_asked = self._is_given = self._is_rest = False
        self._opened_by = ""
        self._sent, self._next_s = 0, math.inf
        self._home: Pose = (0.0, 0.0, 0.0)

    @property
    def name(self) -> str:
        """Of the step that goes on; empty before the first and after the last."""
        step = None if self._advice is None else self._advice.step
        return "" if step is None else step.name

    @property
    def outcomes(self) -> dict[str, str]:
        """How each step ended."""
        return self._sequence.outcomes

    @property
    def floats(self) -> bool:
        """Whether the float air is on."""
        return self._watch.floats

    @property
    def pose(self) -> Pose:
        """The newest that was looked at."""
        return self._pose

    def take(self, message: Message) -> None:
        """Take a message of the vehicle."""
        self._watch.take(message)
        if not isinstance(message, VehicleState) or message.status == "starting":
            return
        if message.stamp_ns - self._looked_ns < LOOK_EVERY_S * 1e9:
            return
        pose = (*message.position_table_m, message.heading_rad)
        if self._looked_ns and self._watch.floats:
            self._travelled_m += math.dist(pose[:2], self._pose[:2])
            self._turned_rad += abs(wrap_angle(pose[2] - self._pose[2]))
        self._looked_ns, self._pose = message.stamp_ns, pose

    def advice(self, now_s: float, known: Mapping[str, float]) -> Advice:
        """What to do now.

        Args:
            now_s: Any steady clock.
            known: Quantities of the goals beyond ``rest_s``, ``turned_rad`` and ``travelled_m``.
        """
        known = self._amounts(now_s) | dict(known)
        if self._refusal:
            advice = self._sequence.give_up(now_s, known, self._refusal)
        else:
            advice = self._sequence.update(now_s, known)
        if advice.is_new:
            self._begin_step(now_s, is_rest=advice.step is not None and advice.step.is_rest)
        step = advice.step
        is_flown = step is not None and not step.is_rest and not step.is_by_hand
        waits = self._watch.waits() if is_flown else ""
        self._advice = replace(advice, note=waits)
        return self._advice

    def hindrance(self) -> str:
        """Why the calibration cannot begin yet; empty if it can."""
        return self._watch.unknown()

    def trouble(self) -> str:
        """Why it ends early: somebody else has taken the vehicle; empty if nobody has."""
        step = None if self._advice is None else self._advice.step
        if not self._is_given or (step is not None and step.is_by_hand):
            return self._watch.stopped()
        return self._watch.taken(is_rest=self._is_rest)

    def answer(self, action: str, reason: str) -> None:
        """Note what became of a request; a refusal, with its reason, ends the step."""
        if reason:
            self._refusal = f"{action} was refused: {reason}"
        elif action in ("land", "fly", "float_on", "resume"):
            self._is_given = True

    def requests(self, now_s: float) -> Iterator[Wish]:
        """What the step of the last advice wants the vehicle to do, now and then."""
        step = None if self._advice is None else self._advice.step
        if step is None or self._refusal:
            return
        if not self._is_asked:
            yield from self._opening(step)
            return
        if step.is_by_hand or step.is_rest or not self._is_given or self._watch.waits():
            return
        if self._next_s == math.inf:
            self._home, self._next_s = self._pose, now_s + SETTLE_S
        if now_s < self._next_s:
            return
        self._next_s = now_s + self._every_s
        x_m, y_m, heading_rad = inside(self._manoeuvres[step.name](self._sent, self._home), self._keep_in)
        self._sent += 1
        yield "go_to", {"x_m": x_m, "y_m": y_m, "heading_rad": math.remainder(heading_rad, math.tau)}

    def _opening(self, step: Step) -> Iterator[Wish]:
        """What a step has to begin with, as the vehicle is by now."""
        watch, wanted = self._watch, "fly"
        if step.is_rest:
            wanted = "land"
        elif watch.mode == (Mode.FLOATING if step.is_by_hand else Mode.FLYING):
            self._is_asked = self._is_given = True
            return
        elif step.is_by_hand:  # a controller that flies would work against the hand
            wanted = "land" if watch.wants_flight else "float_on"
        elif watch.mode in (Mode.BRAKING, Mode.HOLDING):
            wanted = "resume"
        if wanted == self._opened_by or (wanted in ("fly", "float_on") and watch.is_on_its_way_down):
            return
        self._opened_by = wanted
        self._is_asked = step.is_rest or wanted != "land"
        yield wanted, {}

    def _begin_step(self, now_s: float, *, is_rest: bool) -> None:
        """Forget the step before, but not that it has been given what this one needs as well."""
        self._is_given = self._is_given and self._is_rest == is_rest
        self._is_asked, self._is_rest, self._refusal = self._is_given, is_rest, ""
        self._opened_by = ""
        self._began_s, self._next_s, self._sent = now_s, math.inf, 0

    def _amounts(self, now_s: float) -> dict[str, float]:
        """Amounts; of a rest, the part without a break that lies in this step."""
        rest_s = min(self._watch.rest_s, now_s - self._began_s) if self._is_rest else 0.0
        return {"rest_s": rest_s, "turned_rad": self._turned_rad, "travelled_m": self._travelled_m}
