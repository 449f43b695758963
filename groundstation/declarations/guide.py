"""Guided calibrations: what a person is told, what is drawn meanwhile, what comes out.

A guide needs no terminal, no screen and no clock: it takes messages, gives advice and pictures as plain
numbers, and names the requests that a person would make. A terminal leads it, the console does, and a
lockstep runner does. Guides are entry points of the group ``groundstation.wizards``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal, Protocol

from groundstation.declarations.message import Message
from groundstation.declarations.request import Value
from groundstation.declarations.rig import Rig
from groundstation.files.writing import Content

Mark = Literal["line", "dots", "crosses", "refused"]
Wish = tuple[str, Mapping[str, Value]]
"""An action, and its arguments by name."""


@dataclass(frozen=True, slots=True)
class Goal:
    """One number that must fall below (or, for amounts, rise above) a limit."""

    quantity: str
    limit: float
    unit: str
    is_amount: bool = False

    def share(self, value: float) -> float:
        """Return how far it is reached, 0 to 1; a sigma falls with the root of the data, so squared."""
        if self.is_amount:
            return max(0.0, min(1.0, value / self.limit))
        return 1.0 if value <= self.limit else (self.limit / value) ** 2


@dataclass(frozen=True, slots=True)
class Step:
    """One row: an instruction and what ends it."""

    name: str
    instruction: str
    is_rest: bool
    goals: tuple[Goal, ...]
    longest_s: float
    """After this long it is given up, with what is known by then."""
    is_by_hand: bool = False
    """A person moves the vehicle, driven or not: of it only the float air is asked for."""


@dataclass(frozen=True, slots=True)
class Advice:
    """What the operator is to do now."""

    step: Step | None
    """None when all is done."""
    done: float
    """Share of the step, 0 to 1."""
    missing: str
    """The goal that is furthest away, in words; empty when none is."""
    is_new: bool
    """Whether the step has just begun."""
    ended: str = ""
    """How the step before ended, if this one has just begun."""
    note: str = ""
    """What else the operator has to know: that it moves by itself, or what it waits for."""


@dataclass(frozen=True, slots=True)
class Curve:
    """Points that belong together.

    Attributes:
        name: For the legend.
        x: Of each point, in the drawing's unit.
        y: Likewise; NaN leaves a gap.
        mark: How they are drawn; ``refused`` are crosses in the colour of what is wrong.
        sigma: Of each y, drawn as a bar; empty for none.
    """

    name: str
    x: Sequence[float]
    y: Sequence[float]
    mark: Mark = "dots"
    sigma: Sequence[float] = ()


@dataclass(frozen=True, slots=True)
class Drawing:
    """A picture as plain numbers, for whoever can draw.

    Attributes:
        title: What it shows.
        x_label: With its unit.
        y_label: With its unit.
        curves: What is drawn.
        is_to_scale: A metre is as long along x as along y.
        is_downwards: y grows downwards, as the rows of a picture do.
    """

    title: str
    x_label: str
    y_label: str
    curves: Sequence[Curve]
    is_to_scale: bool = False
    is_downwards: bool = False


class Number(Protocol):
    """A number with its sigma (NaN where it is not known) and unit."""

    @property
    def value(self) -> float:
        """In the unit."""

    @property
    def sigma(self) -> float:
        """One standard deviation, same unit."""

    @property
    def unit(self) -> str:
        """In words."""


class Found(Protocol):
    """What a guided calibration gives back."""

    @property
    def title(self) -> str:
        """What was calibrated."""

    @property
    def summary(self) -> str:
        """The result in a line or several."""

    @property
    def quantities(self) -> Mapping[str, Number]:
        """The result by name."""

    @property
    def residual(self) -> Mapping[str, Number]:
        """How well the data fit that it was made from."""

    @property
    def verification(self) -> Mapping[str, Number]:
        """How well data fit that had no part in it; empty where there are none."""

    @property
    def verified_by(self) -> str:
        """What those data are, in words."""

    @property
    def warnings(self) -> Sequence[str]:
        """What may be wrong although there is a result, a sentence each."""

    @property
    def drawings(self) -> Sequence[Drawing]:
        """Residuals to be looked at before it is accepted."""

    def written(self, out: Path, source: str, sha256: str, made_utc: datetime) -> Mapping[Path, Content]:
        """The files of the result: ``out``, and beside it what belongs to it.

        Args:
            out: TOML.
            source: What it was made from, in words.
            sha256: Of that.
            made_utc: When.
        """


class Guide(Protocol):
    """One calibration that is going on."""

    kinds: tuple[type[Message], ...]
    """Classes of the messages that it takes."""

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message of the vehicle, or of the rig."""

    def advice(self, now_s: float) -> Advice:
        """Return what to do now; its step is None when there is enough data."""

    def pictures(self) -> Sequence[Drawing]:
        """Return what the data look like at this moment, a few hundred points each."""

    def hindrance(self) -> str:
        """Return why it cannot begin yet, a sentence; empty if it can."""

    def requests(self, now_s: float) -> Iterator[Wish]:
        """Yield what the vehicle has to be asked for, if it is to be driven."""

    def answer(self, action: str, reason: str) -> None:
        """Note that a request was carried out, or (with a reason) refused: a refusal ends the step."""

    def trouble(self) -> str:
        """Return why a driven calibration ends early, a sentence; empty while it goes on."""

    def outcome(self) -> Found:
        """Return the result; it may take long.

        Raises:
            ValueError: The data do not give one; the message says what is missing.
        """


class Wizard(Protocol):
    """A kind of guided calibration."""

    summary: str

    def missing(self, rig: Rig, vehicle: str) -> str:
        """Return what the rig lacks for it, in words; empty if nothing."""

    def begin(self, rig: Rig, vehicle: str) -> Guide:
        """Begin to calibrate a vehicle."""
