"""The valves of a running vehicle identified step by step: a rest, flights, and a flight to verify by."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from calibration.guided_steps import GuidedSteps
from calibration.laboratory.valve_check import (
    WINDOW_S,
    Misses,
    ValveCheck,
    Valves,
    as_the_rig_has_it,
    known_or_the_rigs,
)
from calibration.live_curve import LiveCurve
from calibration.manoeuvres import tour
from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Quantity, quantity_lines
from calibration.stepped_guide import SteppedGuide
from groundstation.declarations.guide import Advice, Curve, Drawing, Goal, Mark, Step
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.parts.imu.messages import Imu
from groundstation.parts.supervision.messages import ValvesLearned
from groundstation.parts.supervision.part import identification_config, valve_learner

CHECK = "check"
STEPS: tuple[Step, ...] = (
    Step(
        "rest",
        "Land the vehicle (float air off) and keep your hands off: the IMU's zeros are taken.",
        True,
        (Goal("rest_s", 8.0, "s", is_amount=True),),
        90.0,
    ),
    Step(
        "fly",
        "Let it fly to and fro with turns, so that every valve pushes; keep your hands off.",
        False,
        (
            Goal("valves_known", 8.0, "valves", is_amount=True),
            Goal("travelled_m", 1.0, "m", is_amount=True),
            Goal("thrust_sigma", 0.02, "1"),
            Goal("dead_time_sigma_s", 5e-4, "s"),
        ),
        300.0,
    ),
    Step(
        CHECK,
        "Let it go on flying: this part is kept apart, and judges the result.",
        False,
        (Goal("checked_s", 40.0, "s", is_amount=True),),
        120.0,
    ),
)
EVERY_S = 7.0
MOST_ASIDE = 0.02
"""Share of a flight that something else may have pushed in."""
AXES = (
    ("velocity_x", 1e3, "mm/s", "m/s"),
    ("velocity_y", 1e3, "mm/s", "m/s"),
    ("rate", 1e3, "mrad/s", "rad/s"),
)


class GuidedValves(SteppedGuide):
    """One identification: a learner of its own, and a flight set aside.

    Args:
        rig: Of the run.
        vehicle: Which one.
    """

    def __init__(self, rig: Rig, vehicle: str) -> None:
        manoeuvres = {"fly": tour, CHECK: tour}
        super().__init__(GuidedSteps(vehicle, rig.table.keep_in(), STEPS, manoeuvres, EVERY_S))
        self._rig, self._vehicle = rig, vehicle
        self._learner = valve_learner(rig, vehicle)
        self.kinds: tuple[type[Message], ...] = tuple(
            dict.fromkeys((*self._learner.inputs, *GuidedSteps.kinds))
        )
        type_ = rig.type_of(vehicle)
        self._thrust_n = type_.valves.thrust_n
        self._config = identification_config(rig, vehicle)
        self._check = ValveCheck(type_.model(), self._config)
        self._learned: ValvesLearned | None = None
        self._flown_s = 0.0
        self._force = [LiveCurve(f"force {axis}, mm/s²", "line", 0.05) for axis in "xy"]

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message of the vehicle; those of the last step are not learned from."""
        if message.vehicle != self._vehicle:
            return
        self.steps.take(message)
        if isinstance(message, Imu):
            for curve, force in zip(self._force, message.force_body_m_s2, strict=True):
                curve.add(message.stamp_ns * 1e-9, 1e3 * force)
        if self.steps.name == CHECK:
            self._check.take(message)
        elif isinstance(message, self._learner.inputs):
            if isinstance(message, Imu) and self.steps.floats:
                self._flown_s += message.window_s
            list(self._learner.receive(message, now_ns))

    def advice(self, now_s: float) -> Advice:
        """Return what to do now."""
        for learned in self._learner.tick(round(now_s * 1e9)):
            if isinstance(learned, ValvesLearned):
                self._learned = learned
        return super().advice(now_s)

    def pictures(self) -> Sequence[Drawing]:
        """Return each valve as it is known by now, and what the accelerometers read."""
        learned, curves = self._learned, []
        if learned is not None:
            for name, values, sigmas, mark in _columns(learned):
                known = [k for k, value in enumerate(values) if math.isfinite(value)]
                curves.append(
                    Curve(
                        name,
                        [float(k) for k in known],
                        [100.0 * values[k] for k in known],
                        mark,
                        [100.0 * sigmas[k] for k in known],
                    )
                )
        return (
            Drawing("Each valve over the rig's", "valve", "%", curves),
            Drawing("What the accelerometers read", "time, s", "mm/s²", [c.curve() for c in self._force]),
        )

    def outcome(self) -> Outcome:
        """Return thrust, torque and dead time of each valve, tried on the flight set aside.

        Raises:
            CalibrationRefusedError: No valve was learned.
        """
        learned = self._learned
        if learned is None or not any(map(math.isfinite, learned.thrust_over_mass_ratio)):
            raise CalibrationRefusedError("no valve has pushed long enough to be known")
        quantities = _quantities(learned, self._thrust_n)
        unknown = [k for k, ratio in enumerate(learned.thrust_over_mass_ratio) if not math.isfinite(ratio)]
        warnings = tuple(f"valve {k} has not pushed long enough to be known" for k in unknown)
        aside = learned.set_aside * self._config.block_s / max(self._flown_s, self._config.block_s)
        if aside > MOST_ASIDE:
            warnings += (
                f"{100.0 * aside:.0f} % of the flight fits no push of valves: something else pushed, or the "
                "stamps of IMU and commands do not agree (is the machine overloaded?)",
            )
        verification, complaint, drawings = self._verified(learned)
        return Outcome(
            title=f"Valves of {self._vehicle}, guided",
            summary="\n".join(quantity_lines(quantities)),
            quantities=quantities,
            residual={},
            notes={
                "set_aside_blocks": learned.set_aside,
                "assumed": "mass and inertia of the rig: a mass that is wrong looks like valves that all are",
                **{f"step_{step}": outcome for step, outcome in self.outcomes.items()},
            },
            warnings=(*warnings, *complaint),
            verification=verification,
            verified_by=f"a flight of {self._check.length_s:.0f} s, in windows of {WINDOW_S:g} s"
            if verification
            else "",
            drawings=drawings,
        )

    def _verified(
        self, learned: ValvesLearned
    ) -> tuple[dict[str, Quantity], tuple[str, ...], tuple[Drawing, ...]]:
        rigs = as_the_rig_has_it(len(learned.open_s), self._config)
        found = Valves(
            known_or_the_rigs(learned.thrust_over_mass_ratio, rigs.thrust),
            known_or_the_rigs(learned.torque_over_inertia_ratio, rigs.torque),
            known_or_the_rigs(learned.dead_time_s, rigs.dead_s),
        )
        try:
            before, after = self._check.misses(rigs), self._check.misses(found)
        except CalibrationRefusedError as error:
            return {}, (f"it is not verified: {error}",), ()
        numbers = {
            f"{name}{ending}": Quantity(float(rms), math.nan, unit)
            for ending, each in (("", after), ("_as_the_rig_has_it", before))
            for (name, _, _, unit), rms in zip(AXES, each.rms, strict=True)
        }
        numbers["windows"] = Quantity(float(len(after.t_s)), math.nan, "1")
        worse = [name for (name, *_), a, b in zip(AXES, after.rms, before.rms, strict=True) if a > 1.1 * b]
        complaint = (
            (f"the flight set aside is predicted worse than by the rig's own values: {', '.join(worse)}",)
            if worse
            else ()
        )
        return numbers, complaint, tuple(_drawing(k, before, after) for k in range(3))

    def known(self) -> dict[str, float]:
        """Return the quantities of the goals."""
        learned = self._learned
        known = {"checked_s": self._check.length_s}
        if learned is None:
            return known
        sigmas = np.array(learned.thrust_over_mass_sigma)
        dead_s = np.array(learned.dead_time_sigma_s)
        is_known = np.isfinite(sigmas) & np.isfinite(dead_s)
        known["valves_known"] = float(is_known.sum())
        if is_known.any():
            known["thrust_sigma"] = float(sigmas[is_known].max())
            known["dead_time_sigma_s"] = float(dead_s[is_known].max())
        return known


def _columns(
    learned: ValvesLearned,
) -> tuple[tuple[str, Sequence[float], Sequence[float], Mark], ...]:
    return (
        ("thrust over mass", learned.thrust_over_mass_ratio, learned.thrust_over_mass_sigma, "dots"),
        (
            "torque over inertia",
            learned.torque_over_inertia_ratio,
            learned.torque_over_inertia_sigma,
            "crosses",
        ),
    )


def _quantities(learned: ValvesLearned, thrust_n: float) -> dict[str, Quantity]:
    ratio, sigma = np.array(learned.thrust_over_mass_ratio), np.array(learned.thrust_over_mass_sigma)
    known = np.isfinite(ratio)
    found = {
        "thrust_n": Quantity(
            thrust_n * float(ratio[known].mean()),
            thrust_n * float(np.sqrt((sigma[known] ** 2).sum())) / int(known.sum()),
            "N",
        )
    }
    for valve in np.flatnonzero(known).tolist():
        rows = (
            ("thrust_over_mass", learned.thrust_over_mass_ratio, learned.thrust_over_mass_sigma, "1"),
            (
                "torque_over_inertia",
                learned.torque_over_inertia_ratio,
                learned.torque_over_inertia_sigma,
                "1",
            ),
            ("dead_time", learned.dead_time_s, learned.dead_time_sigma_s, "s"),
        )
        for name, values, sigmas, unit in rows:
            if math.isfinite(values[valve]):
                found[f"valve_{valve}_{name}"] = Quantity(values[valve], sigmas[valve], unit)
    return found


def _drawing(axis: int, before: Misses, after: Misses) -> Drawing:
    name, factor, unit, _ = AXES[axis]
    rows: tuple[tuple[str, Misses, Mark], ...] = (
        ("as the rig has it", before, "refused"),
        ("with the result", after, "dots"),
    )
    curves = [
        Curve(words, (factor * each.moved[:, axis]).tolist(), (factor * each.missed[:, axis]).tolist(), mark)
        for words, each, mark in rows
    ]
    title = f"Measured less predicted, flight set aside: {name.replace('_', ' ')}"
    return Drawing(title, f"measured, {unit}", f"missed, {unit}", curves)


class ValveWizard:
    """Makes guided identifications of the valves."""

    summary = "Valves: thrust, torque and dead time of each, by flying to and fro."

    def missing(self, rig: Rig, vehicle: str) -> str:
        """Nothing: each vehicle has valves and an IMU."""
        del rig, vehicle
        return ""

    def begin(self, rig: Rig, vehicle: str) -> GuidedValves:
        """Begin to identify the valves of a vehicle."""
        return GuidedValves(rig, vehicle)


WIZARD = ValveWizard()
